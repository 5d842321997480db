"""A system with its numbers and its vehicle: what every analysis is given."""
