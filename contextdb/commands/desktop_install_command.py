"""Let the desktop open tables in the editor: it is then in the menu, and under "Open with" for a CSV or Parquet file.

With --default a double click on such a file opens it. It is written for this user alone, where freedesktop.org says, so for GNOME,
KDE, Xfce and others; running it again changes nothing. Needs: pip install "contextdb[browser]".

  contextdb desktop install
  contextdb desktop install --default
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from contextdb.console import ExitCode, printable
from contextdb.disk import make_folder, read_bytes, write_atomic
from contextdb.errors import ContextDBError, Fault

NAME = "contextdb.desktop"
TYPES = ("text/csv", "application/vnd.apache.parquet")
ENTRY = """[Desktop Entry]
Type=Application
Name=contextdb
GenericName=Table editor
Comment=Edit tables of animations and game conditions
Exec={command} -m contextdb edit --browser -- %f
Icon=x-office-spreadsheet
Terminal=false
Categories=Office;Spreadsheet;
MimeType={types};
"""


class DesktopError(ContextDBError):
    """The desktop of this system is set up in another way."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--default", action="store_true", help="open these files with a double click, instead of what does it now")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Write what is missing, and say so."""
    path = entry_path()
    entry = ENTRY.format(command=_quoted(sys.executable), types=";".join(TYPES)).encode()
    if path.exists() and read_bytes(path) == entry:
        print(printable(f"{path}: all is set"))
    else:
        make_folder(path.parent)
        write_atomic(path, entry)
        print(printable(f"{path}: written"))
    refresh(path.parent)
    if arguments.default:
        _make_default()
        print(printable(f"a double click opens {' and '.join(TYPES)}"))
    return ExitCode.OK


def entry_path() -> Path:
    """The file that the desktop reads. Raises DesktopError on systems that read none."""
    if sys.platform in ("win32", "darwin"):
        problem = "this system does not read files of freedesktop.org."
        raise DesktopError(
            Fault(problem, "Linux, or another Unix with a desktop", "to start it with: contextdb edit --browser TABLE")
        )
    home = os.environ.get("XDG_DATA_HOME", "")
    return (Path(home) if os.path.isabs(home) else Path.home() / ".local" / "share") / "applications" / NAME


def refresh(folder: Path) -> None:
    """Have the desktop read the folder again, where it needs that."""
    if program := shutil.which("update-desktop-database"):
        subprocess.run([program, str(folder)], capture_output=True, check=False, timeout=60)


def _make_default() -> None:
    program = shutil.which("xdg-mime")
    if program is None:
        mend = 'to choose it in the file manager, under "Open with"'
        raise DesktopError(Fault("xdg-mime is not installed, which sets what a double click opens.", "xdg-utils", mend))
    done = subprocess.run([program, "default", NAME, *TYPES], capture_output=True, encoding="utf-8", check=False, timeout=60)
    if done.returncode:
        raise DesktopError(Fault(f"xdg-mime does not set it: {done.stderr.strip() or done.returncode}."))


def _quoted(path: str) -> str:
    """A program as a line "Exec" names it: in quotes, for the entry's own escapes and those of the line."""
    escaped = re.sub(r'(["`$\\])', r"\\\1", path).replace("\\", "\\\\").replace("%", "%%")
    return f'"{escaped}"'
