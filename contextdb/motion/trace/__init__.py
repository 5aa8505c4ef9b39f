"""Recorded sessions and the views of them."""
