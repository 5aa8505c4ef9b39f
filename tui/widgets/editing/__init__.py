"""The parts of the cell editor."""
