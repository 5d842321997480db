"""What all fits share: grids of altitude, intervals of covariances, poles, progress."""
