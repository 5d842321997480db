"""From C source to a loaded library: compiler, cache, fingerprint, printer, templates."""
