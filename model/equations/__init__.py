"""The equations, a file for each block of the report, assembled into one linear system."""
