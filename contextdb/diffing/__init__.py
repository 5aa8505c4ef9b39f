"""The parts of `contextdb.diff`: which rows and columns are which, what order two sides agree on, and the edits that follow."""
