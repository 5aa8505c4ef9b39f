"""What contextdb.toml says of motion, and databases on the disk."""
