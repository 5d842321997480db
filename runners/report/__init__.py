"""One self-contained HTML page of what a results folder holds."""
