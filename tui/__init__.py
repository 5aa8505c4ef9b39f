"""The terminal editor of contextdb's tables. `tui.model` knows no terminal; everything else is a view of it, in Textual."""
