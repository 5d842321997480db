"""Exact derivatives of statistics by parameters, tables and rows."""
