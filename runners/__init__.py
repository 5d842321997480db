"""Response statistics, checks, figures and the command line."""
