"""Our numbers beside those the report published: prediction, options, wind models, calibration, flight checks."""
