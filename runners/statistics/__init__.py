"""Response statistics: engines, results, weighting functions, peaks, agreement and tolerance."""
