"""What the terminal sends, read as keys: Alt and a letter is one key, and no part of a key is ever typed as text.

A terminal without extended keys sends Esc and the letter for Alt+letter, Esc alone for Esc, and Esc with a few signs for others.
Textual reads a character at a time, and where it does not know what an Esc begins it passes the signs on as text ("^g"). Here the
input is cut into whole units first, by the grammar of ECMA-48: text, Esc and a key, or a control sequence. Only whole units are
looked up; one that nobody knows is dropped. What one key sends may come in several reads, and what several keys send in one.

Some keys send the same as others: Esc pressed just before a letter is Alt and that letter. Alt+F and Alt+B are what macOS sends for
Option+Right and Option+Left, so they are Ctrl+Right and Ctrl+Left.

Source: ECMA-48, section 5; "XTerm Control Sequences"; the keyboard protocol of kitty; Textual's issue 872.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Generator, Iterable, Iterator
from time import monotonic

from textual import constants, events
from textual._ansi_sequences import ANSI_SEQUENCES_KEYS
from textual._xterm_parser import BRACKETED_PASTE_END, BRACKETED_PASTE_START, XTermParser
from textual.keys import Keys
from textual.message import Message

ESC = "\x1b"
PART_S = 1.0
"""So long the rest of a sequence is waited for. Esc alone is waited for only `constants.ESCAPE_DELAY`: it is a key of its own."""

_UNIT = re.compile(
    r"""
      [^\x1b]+                                                     # text and control characters
    | \x1b \[ M [\s\S]{3}                                          # the mouse, as terminals of old send it
    | \x1b \[ (?: \[ [\s\S] | \d+ \$ )                             # function keys of the Linux console, and of rxvt
    | \x1b \[ (?! [M\[] ) [0-?]* [ -/]* [@-~]                      # a control sequence
    | \x1b O [\d;]* [ @-~]                                         # a key of the keypad, or F1 to F4
    | \x1b (?: \]\d | P[\d>!+$|] | _G ) [^\x1b\x07]* (?: \x07 | \x1b\\ )     # an answer to a question about the terminal
    | \x1b [^\x1b\[O\]P_]                                          # Alt and a key
    """,
    re.VERBOSE,
)
_BEGUN = re.compile(
    r"""
    \x1b (?: \[ (?: M [\s\S]{0,2} | \[ | [0-?]* [ -/]* )
            | O [\d;]*
            | (?: \]\d | P[\d>!+$|] | _G ) [^\x1b\x07]* (?: \x1b \Z )?
            | [\]P_]
          )?
    """,
    re.VERBOSE,
)
"""The longest beginning of a unit, for what is no unit or not yet."""
_PLACE = re.compile(r"\x1b\[(?!1;[2-8]R)\d+;\d+R")
"""Where the terminal's cursor stands; not F3 with Shift, Alt or Ctrl, which looks alike."""
_WITH_TEXT = re.compile(r"\x1b\[(\d+)([:\d]*);(\d+);(\d+)u")
"""A key of kitty's protocol with the text that it gives."""
_LONGEST = 32
"""Textual takes a longer sequence for text."""
_ALT, _CTRL, _HELD = 0b10, 0b100, 0b111110
"""Modifiers in kitty's protocol; all but Shift."""


class KeyParser(XTermParser):
    """Textual's reader of terminals, which sees whole units only."""

    def __init__(self, debug: bool = False, clock: Callable[[], float] = monotonic) -> None:
        super().__init__(debug)
        self._clock = clock
        self._begun = ""
        """What has come of a unit that is not whole yet."""
        self._due = 0.0
        """When that is taken as it is."""
        self._pasted: list[str] | None = None
        """What has come of a paste."""

    def feed(self, data: str) -> Iterable[Message]:
        """The events of what came, and of what came before and is whole now; an empty text ends it all."""
        if not data:
            yield from self._give_up()
            yield from super().feed(data)
            return
        data, self._begun = self._begun + data, ""
        at = 0
        while at < len(data):
            if self._pasted is not None:
                at = yield from self._paste(data, at)
            elif unit := _UNIT.match(data, at):
                at = unit.end()
                yield from self._read(unit[0])
            else:
                begun = _begun(data, at)
                at += len(begun)
                if at == len(data):
                    self._wait_for_more(begun)
                else:
                    yield from self._broken(begun)

    def tick(self) -> Iterable[Message]:
        """The events of what was begun and did not go on in time."""
        if self._begun and self._pasted is None and self._clock() >= self._due:
            yield from self._give_up()

    # ---- units

    def _read(self, unit: str) -> Iterator[Message]:
        if unit[0] != ESC:
            yield from super().feed(unit)
        elif unit == BRACKETED_PASTE_START:
            self._pasted = []
        elif len(unit) == 2:
            yield from self._alt(unit[1])
        elif unit[1] in "[O":
            yield from self._sequence(unit)

    def _alt(self, character: str) -> Iterator[Message]:
        """Alt and a key, without text; a few of them terminals send for another key."""
        meant = ANSI_SEQUENCES_KEYS.get(ESC + character)
        if isinstance(meant, tuple):
            yield from (events.Key(key.value, None) for key in meant)
            return
        for event in self._sequence_to_key_events(character):
            *held, key = event.key.split("+")
            if len(key) == 1 and key.isupper():
                held, key = [*held, "shift"], key.lower()
            yield events.Key("+".join([*sorted({"alt", *held}), key]), None)

    def _sequence(self, unit: str) -> Iterator[Message]:
        try:
            keys = [] if _PLACE.fullmatch(unit) else list(self._sequence_to_key_events(_WITH_TEXT.sub(_with_modifiers, unit)))
        except (ValueError, OverflowError):  # a character that there is not
            return
        if keys:
            yield from (key for key in keys if key.key != Keys.Ignore)
        elif len(unit) <= _LONGEST:
            yield from super().feed(unit)
            self._close()

    def _close(self) -> None:
        """Have Textual begin again: it still waits for the end of what it does not know."""
        if self._awaiting.timeout is not None:
            self._gen = self.parse(self._tokens.append)
            self._awaiting, self._timeout_time = next(self._gen), None

    def _paste(self, data: str, at: int) -> Generator[Message, None, int]:
        """Take what is pasted as it is; gives where in the data it ends."""
        assert self._pasted is not None
        end = data.find(BRACKETED_PASTE_END, at)
        if end < 0:
            n_kept = next((n for n in range(len(BRACKETED_PASTE_END) - 1, 0, -1) if data.endswith(BRACKETED_PASTE_END[:n], at)), 0)
            self._pasted.append(data[at : len(data) - n_kept])
            self._begun = data[len(data) - n_kept :]
            return len(data)
        text = "".join([*self._pasted, data[at:end]]).replace("\x00", "")
        self._pasted = None
        yield events.Paste(text)
        return end + len(BRACKETED_PASTE_END)

    # ---- what is not whole

    def _wait_for_more(self, begun: str) -> None:
        self._begun, self._due = begun, self._clock() + (constants.ESCAPE_DELAY if begun == ESC else PART_S)

    def _give_up(self) -> Iterator[Message]:
        begun, self._begun = self._begun, ""
        yield from self._broken(begun)

    def _broken(self, begun: str) -> Iterator[Message]:
        """Esc by itself, or Alt and a sign that could have begun more; of anything longer the rest is lost, and it is dropped."""
        if begun == ESC:
            yield events.Key("escape", ESC)
        elif len(begun) == 2:
            yield from self._alt(begun[1])


class WindowsKeyParser(KeyParser):
    """The reader for Windows, whose console sends NUL for Shift, Ctrl and Alt by themselves: no key, least of all Ctrl+Space."""

    def feed(self, data: str) -> Iterable[Message]:
        """The events of what came, but for NUL."""
        keys = data.replace("\x00", "")
        return super().feed(keys) if keys or not data else ()


def _begun(data: str, at: int) -> str:
    match = _BEGUN.match(data, at)
    assert match is not None
    return match[0]


def _with_modifiers(match: re.Match[str]) -> str:
    """A key of kitty's protocol with modifiers and text: a command, or the text, by what the modifiers are."""
    code, others, modifiers, text = match.groups()
    held = int(modifiers) - 1 & _HELD
    if held == _ALT | _CTRL:  # AltGr on Windows
        return f"{ESC}[{code}{others};1;{text}u"
    is_own = chr(int(text)).casefold() == chr(int(code)).casefold()
    if held and (held != _ALT or is_own):  # Option on macOS gives another text than the key's own
        return f"{ESC}[{code}{others};{modifiers}u"
    return match[0]


def read_whole_keys() -> None:
    """Have Textual's drivers, of this system's terminals and of browsers, read keys with `KeyParser`."""
    is_windows = sys.platform == "win32"
    drivers = {"win32": WindowsKeyParser} if is_windows else {"linux_driver": KeyParser}
    for name, parser in {**drivers, "web_driver": KeyParser}.items():
        vars(importlib.import_module(f"textual.drivers.{name}"))["XTermParser"] = parser
