"""Wind fits: intervals, correlation, verification and figures."""
