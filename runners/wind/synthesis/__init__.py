"""Shaping filters from covariances, one file a method."""
