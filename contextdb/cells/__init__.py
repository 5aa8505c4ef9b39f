"""What one cell accepts, and what the game says of its condition."""
