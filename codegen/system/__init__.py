"""A linear system's functions: expressions, C, and the executable that holds the numbers."""
