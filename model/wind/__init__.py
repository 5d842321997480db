"""The wind: statistics, correlation, shaping filters and their files, turbulence."""
