"""From C source to a loaded library: printer, templates, fingerprint, compiler, cache, and the life of a library."""
