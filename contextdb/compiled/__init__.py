"""A table as masks, and each way to ask it."""
