"""Load relief: gains with the lowest peak load under limits."""
