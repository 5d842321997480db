"""The sweep in C: all end times in one pass."""
