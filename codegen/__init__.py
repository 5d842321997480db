"""Turns a model into C, compiles it and loads it."""
