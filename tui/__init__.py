"""The terminal editor of contextdb's tables, opened by `contextdb edit`. It imports contextdb, never the other way round."""
