"""A page in a browser that plays characters by a table: the core as WebAssembly."""
