"""From an executable system to arrays: every integrator, and what they share."""
