"""contextdb.toml: its text and its meaning."""

from contextdb.schema.settings import TableSettings

__all__ = ["TableSettings"]
