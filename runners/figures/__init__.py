"""The figure of any result."""
