"""Open tables with a double click, from the desktop: the editor then shows in a browser, and nobody needs a terminal.

  contextdb desktop install
  contextdb desktop uninstall

They change what belongs to this user alone, on Linux and other systems whose desktop reads files of freedesktop.org.
"""

from __future__ import annotations

COMMANDS = {
    "install": "let the desktop open tables in the editor",
    "uninstall": "remove what install wrote",
}
