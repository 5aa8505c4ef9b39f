"""Git for tables: merges and rebases cell by cell, and `git diff` and `git log -p` by asset and cell.

  contextdb git install tables/
  contextdb git status tables/
  contextdb git uninstall tables/

What is written into .gitattributes is for everybody and belongs into the repository; the configuration is each clone's own.
"""

from __future__ import annotations

COMMANDS = {
    "install": "let git merge and show tables cell by cell",
    "uninstall": "take back what install wrote",
    "status": "what is set",
    "text": "a table as git diff shows it, one line a cell",
}
