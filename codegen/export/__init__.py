"""A system with its numbers as a C library of its own, for programs without Python."""
