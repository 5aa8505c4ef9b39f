"""A table's file as texts and back, byte for byte."""
