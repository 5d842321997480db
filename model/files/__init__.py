"""Reading CSV and TOML, with errors that name file, column and line."""
