"""Set git up for tables: merges and rebases cell by cell, and `git diff` and `git log -p` by asset and cell.

  contextdb git install tables/
  contextdb git status tables/
  contextdb git uninstall tables/

Commit .gitattributes to the repository, for everybody; the configuration belongs to each clone.
"""

from __future__ import annotations

COMMANDS = {
    "install": "let git merge and show tables cell by cell",
    "uninstall": "remove what install wrote",
    "status": "what is set",
    "text": "a table as git diff shows it, one line per cell",
}
