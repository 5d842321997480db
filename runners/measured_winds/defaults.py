"""What a day of launch is judged by where nobody says it."""

ERROR = 1.0  # m/s in a component, of a balloon's wind
THRESHOLD = 0.01  # of the chance that a limit is passed: no launch above it
