"""Motion databases and the exact search of their frames."""
