"""The load of the whole flight: the largest value that a response takes in a window, and limits that it may pass."""
