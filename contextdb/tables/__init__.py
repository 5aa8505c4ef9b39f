"""A table, tables in tables, a folder of them, merged and watched."""
