"""How figures look, files are written whole and tables are printed."""
