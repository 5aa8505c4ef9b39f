"""What a person sets once: the theme, and other keys for commands. Read from a TOML file; an edge.

    theme = "nord"

    [keys]
    duplicate = "ctrl+w"
    sort = "shift+f6,f10"

The file is `contextdb/editor.toml` in the folder for settings of the system, or the one that CONTEXTDB_EDITOR names.
"""

from __future__ import annotations

import os
import re
import string
import sys
import tomllib
import unicodedata
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from textual.keys import KEY_TO_UNICODE_NAME, Keys

from contextdb.disk import read_bytes
from contextdb.errors import ContextDBError, Fault, FileError, Place, in_quotes, nearest, no_such

from .commands import BY_ID, COMMANDS

VARIABLE = "CONTEXTDB_EDITOR"
MODIFIERS = ("ctrl", "alt", "shift", "super")
_SIGNS = {re.sub("[ -]", "_", unicodedata.name(sign)).lower() for sign in string.punctuation}
_KEYS = {key.value for key in Keys} | set(KEY_TO_UNICODE_NAME.values()) | _SIGNS


class SettingsError(ContextDBError):
    """What the settings of the editor say cannot be taken."""


@dataclass(frozen=True)
class EditorSettings:
    """What a person set."""

    theme: str | None = None
    keys: Mapping[str, str] = field(default_factory=dict)
    """Command to its keys, with commas between."""


def settings_path() -> Path:
    """Where the settings stand."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA", Path.home())) / "contextdb" / "editor.toml"
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "contextdb" / "editor.toml"


def read_settings(path: Path, themes: Collection[str]) -> EditorSettings:
    """The settings in a file; none where there is no file. Raises SettingsError with everything in the file that cannot be
    taken."""
    if not path.is_file():
        return EditorSettings()
    try:
        document = tomllib.loads(read_bytes(path).decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, FileError) as error:
        raise SettingsError(Fault(f"cannot read the settings of the editor: {error}.", place=Place(str(path)))) from None
    faults = [fault.at(Place(str(path))) for fault in _faults(document, themes)]
    if faults:
        raise SettingsError(*faults)
    return EditorSettings(document.get("theme"), document.get("keys", {}))


def _faults(document: Mapping[str, object], themes: Collection[str]) -> Iterator[Fault]:
    for key in document.keys() - {"theme", "keys"}:
        yield Fault(f"there is no setting {in_quotes(key)}.", "theme, [keys]")
    theme, keys = document.get("theme"), document.get("keys", {})
    if theme is not None and theme not in themes:
        yield no_such("theme", theme, themes, ", ".join(sorted(themes)))
    if not isinstance(keys, dict):
        yield Fault("[keys] is not a table.", 'lines such as duplicate = "ctrl+w"')
        return
    for name, text in keys.items():
        yield from _key_faults(name, text)
    yield from _clashes({name: text for name, text in keys.items() if isinstance(text, str) and name in BY_ID})


def _key_faults(name: str, text: object) -> Iterator[Fault]:
    if name not in BY_ID:
        near = nearest(name, BY_ID)
        yield Fault(f"there is no command {in_quotes(name)}.", "those of docs/keys.md", in_quotes(near) if near else "")
    if not isinstance(text, str) or not text.strip():
        yield Fault(f"the keys of {in_quotes(name)} are not text.", '"ctrl+w", or several with commas between')
        return
    for key in text.split(","):
        *modifiers, last = key.strip().split("+")
        if any(m not in MODIFIERS for m in modifiers) or not (len(last) == 1 or last in _KEYS):
            near = nearest(last, _KEYS)
            mend = in_quotes("+".join([*modifiers, near])) if near else ""
            yield Fault(
                f"there is no key {in_quotes(key.strip())} (for {in_quotes(name)}).", '"ctrl+w", "alt+shift+up", "f10"', mend
            )


def _clashes(keys: Mapping[str, str]) -> Iterator[Fault]:
    """Two commands on one key, where at least one of them was set."""
    taken: dict[str, str] = {}
    for command in COMMANDS:
        for key in filter(None, keys.get(command.id, command.keys).replace(" ", "").split(",")):
            other = taken.setdefault(key, command.id)
            if other != command.id and (command.id in keys or other in keys):
                problem = f"{in_quotes(key)} is the key of {in_quotes(other)} and of {in_quotes(command.id)}."
                yield Fault(problem, "a key of its own for each command")
