"""A vehicle: its file, its tables and their columns, and the ones that ship."""
