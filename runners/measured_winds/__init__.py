"""Measured winds: flown by the weights of their levels, ahead of a launch, and how often a month lets a vehicle fly."""
