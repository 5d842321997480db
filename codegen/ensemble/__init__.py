"""Simulated flights in C: random numbers, exact steps."""
