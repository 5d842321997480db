"""A case handed to others: as a C library, as matrices in files, as objects of control libraries."""
