"""What terminals send for a key, and as which key the editor reads it.

The last table of docs/keys.md has the keys that not every terminal sends.

`xterm` is what xterm sends, and with it tmux, screen, PuTTY and most others. `kitty` is kitty's keyboard protocol with the one
flag that the editor asks for, as kitty, foot, Ghostty, iTerm2 and WezTerm send it. `windows` is Windows Terminal, or the console,
through Textual's driver, which reads console records as characters.

Sources: "XTerm Control Sequences"; kitty's page "Comprehensive keyboard handling in terminals"; `terminalInput.cpp` and
`defaults.json` of github.com/microsoft/terminal; `textual/drivers/win32.py`.
"""

from __future__ import annotations

import sys
import unicodedata
from pathlib import Path

from textual import events
from textual.keys import KEY_NAME_REPLACEMENTS

sys.path.insert(0, str(Path(__file__).parent.parent))

from tui.commands import key_name
from tui.keyboard import KeyParser, WindowsKeyParser

ESC = "\x1b"
MODIFIERS = {"shift": 1, "alt": 2, "ctrl": 4}
CURSOR = {"up": "A", "down": "B", "right": "C", "left": "D", "home": "H", "end": "F", "f1": "P", "f2": "Q", "f3": "R", "f4": "S"}
TILDE = {"insert": 2, "delete": 3, "pageup": 5, "pagedown": 6}
TILDE |= {f"f{n}": code for n, code in zip(range(5, 13), (15, 17, 18, 19, 20, 21, 23, 24), strict=True)}
CHARACTERS = {"enter": "\r", "tab": "\t", "escape": ESC, "backspace": "\x7f", "space": " "}
UNICODE_NAMES = {short: long for long, short in KEY_NAME_REPLACEMENTS.items()} | {"minus": "hyphen-minus"}
SCROLLS = "the terminal scrolls"
TAKEN = {f"ctrl+shift+{key}": SCROLLS for key in ("up", "down", "home", "end")} | {"ctrl+v": "the terminal pastes"}
"""Keys that Windows Terminal keeps for itself, unless its settings say otherwise."""


def xterm(key: str) -> str:
    """What xterm sends."""
    held, last = _parts(key)
    if (sequence := _sequence(held, last)) is not None:
        return sequence
    if key == "shift+tab":
        return f"{ESC}[Z"
    sign = _sign(last)
    if "ctrl" in held and sign not in "\r\t\x1b\x7f":
        sign = "\x00" if sign in " @" else chr(ord(sign.upper()) & 0x1F)
    elif "shift" in held:
        sign = sign.upper()
    return ESC + sign if "alt" in held else sign


def kitty(key: str) -> str:
    """What kitty's protocol sends when ambiguous keys are to be told apart."""
    held, last = _parts(key)
    if last == "f3":  # ESC[1;2R could be where the cursor is
        return f"{ESC}[13{_modifier(held)}~"
    if not held and last in CURSOR:
        return f"{ESC}[{CURSOR[last]}"
    if (sequence := _sequence(held, last)) is not None:
        return sequence
    if last != "escape" and (not held or (held == ["shift"] and last not in CHARACTERS.keys() - {"space"})):
        return xterm(key)
    return f"{ESC}[{ord(' ' if last == '@' else _sign(last))}{_modifier(held)}u"


def windows(key: str) -> str:
    """What Windows sends; empty: Windows Terminal keeps the key."""
    return "" if key in TAKEN else "\n" if key == "ctrl+enter" else xterm(key)


def read(sent: str, parser: type[KeyParser] = KeyParser) -> str:
    """The key that the editor reads from what is sent; empty: none."""
    reader = parser(clock=lambda: 0.0)
    got = [*reader.feed(sent), *(reader._give_up() if reader._begun else ())]
    return next((event.key for event in got if isinstance(event, events.Key)), "")


def is_read_everywhere(key: str) -> bool:
    """Whether every terminal sends the key, and the editor reads it as what it is."""
    sent = ((xterm(key), KeyParser), (kitty(key), KeyParser), (windows(key), WindowsKeyParser))
    return key not in TAKEN and all((got := read(text, parser)) and name(got) == name(key) for text, parser in sent)


def line(key: str) -> str:
    """The line of the table for a key."""
    on_windows = TAKEN.get(key) or _told(key, windows(key), WindowsKeyParser)
    return f"| {name(key)} | {_told(key, xterm(key))} | {_told(key, kitty(key))} | {on_windows} |"


def name(key: str) -> str:
    """A key as people write it; a capital letter has Shift."""
    if len(key) == 1 and key.isupper():
        return f"Shift+{key}"
    return _sign(key).upper() if is_sign(key) else key_name(key)


def is_sign(key: str) -> bool:
    """Whether a key sends itself: a letter, a digit or a sign."""
    return "+" not in key and key not in (CURSOR.keys() | TILDE.keys() | CHARACTERS.keys())


def _told(key: str, sent: str, parser: type[KeyParser] = KeyParser) -> str:
    """What is sent, and which key that is if it is another one."""
    got = read(sent, parser)
    shown = f"`{_shown(sent)}`"
    return shown if got and name(got) == name(key) else f"{shown}, read as {name(got)}" if got else f"{shown}, not read"


def _shown(sent: str) -> str:
    if sent in (" ", "\x7f"):
        return {" ": "space", "\x7f": "DEL"}[sent]
    words = sent.replace(ESC, "ESC ")
    return "".join(f"^{chr(ord(sign) + 64)}" if sign < " " else sign for sign in words)


def _parts(key: str) -> tuple[list[str], str]:
    *held, last = key.split("+")
    return held, last


def _modifier(held: list[str]) -> str:
    """The modifiers as a parameter of a control sequence; empty: none."""
    return f";{1 + sum(MODIFIERS[one] for one in held)}" if held else ""


def _sequence(held: list[str], last: str) -> str | None:
    """The control sequence of a key without a character; None for other keys."""
    if last in TILDE:
        return f"{ESC}[{TILDE[last]}{_modifier(held)}~"
    if last not in CURSOR:
        return None
    if held:
        return f"{ESC}[1{_modifier(held)}{CURSOR[last]}"
    return f"{ESC}{'O' if last.startswith('f') else '['}{CURSOR[last]}"


def _sign(last: str) -> str:
    """The character of a key, by its own name, by Textual's or by Unicode's."""
    if len(last) == 1 or last in CHARACTERS:
        return CHARACTERS.get(last, last)
    return unicodedata.lookup(UNICODE_NAMES.get(last, last).replace("_", " "))
