"""Changes of a table and of what contextdb.toml says of it: undo, diff, files."""
