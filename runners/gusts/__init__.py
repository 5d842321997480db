"""Discrete gusts: shapes, responses by weighting functions, the worst of them, and their place beside other loads."""
