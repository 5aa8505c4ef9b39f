"""What terminals send, read as keys: never a part of a key as text, and never a text lost."""

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual import events
from textual.message import Message

from tui.keyboard import KeyParser, WindowsKeyParser

ESC = "\x1b"
ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
MODIFIERS = {2: "shift", 3: "alt", 4: "alt+shift", 5: "ctrl", 6: "ctrl+shift", 7: "alt+ctrl", 8: "alt+ctrl+shift"}
NAMES = {"[": "left_square_bracket", "]": "right_square_bracket", "_": "underscore", "^": "circumflex_accent", "-": "minus"}
AS_OTHER_KEYS = {"f": "ctrl+right", "b": "ctrl+left"}  # what macOS sends for Option and an arrow


def alt(sign: str) -> tuple[str, str]:
    name = f"shift+{sign.lower()}" if sign.isupper() else NAMES.get(sign, sign)
    return ESC + sign, AS_OTHER_KEYS.get(sign, f"alt+{name}")


STROKES = [
    (ESC, "escape"),
    *(alt(sign) for sign in "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789[]_^-"),
    *((f"{ESC}[{end}", name) for end, name in ARROWS.items()),
    *((f"{ESC}O{end}", name) for end, name in ARROWS.items()),
    *((f"{ESC}[1;{n}{end}", f"{held}+{name}") for end, name in ARROWS.items() for n, held in MODIFIERS.items()),
    *((f"{ESC}[1;{n}R", f"{held}+f3") for n, held in MODIFIERS.items()),
    (f"{ESC}[3;3~", "alt+delete"),
    (f"{ESC}OP", "f1"),
    (f"{ESC}[24~", "f12"),
]
"""What keys send in a terminal without extended keys, all of it beginning with Esc, and what they are."""


class Clock:
    now = 0.0


def read(chunks: Iterable[str], clock: Clock | None = None) -> list[Message]:
    """What is read of chunks that come one right after the other, and then nothing for a while."""
    time = clock or Clock()
    parser = KeyParser(clock=lambda: time.now)
    got: list[Message] = []
    for chunk in chunks:
        got += parser.feed(chunk)
        got += parser.tick()
    time.now += 10
    return [*got, *parser.tick()]


def keys(got: Iterable[Message]) -> list[str]:
    return [event.key for event in got if isinstance(event, events.Key)]


def typed(got: Iterable[Message]) -> str:
    """What would stand in a cell: all characters but those of Esc, Ctrl and a letter, and the like."""
    return "".join(e.character for e in got if isinstance(e, events.Key) and e.character and e.character >= " ")


@st.composite
def split(draw: st.DrawFn, whole: str) -> list[str]:
    """A text in pieces, as reads of a terminal may cut it."""
    cuts = sorted(draw(st.sets(st.integers(1, max(len(whole) - 1, 1)), max_size=8)))
    ends = [*cuts, len(whole)]
    return [piece for start, end in zip([0, *cuts], ends, strict=True) if (piece := whole[start:end])]


texts = st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=12) | st.text("^¡™£¢∞§1g[O;~", max_size=6)


@given(st.data(), st.lists(st.sampled_from(STROKES), min_size=1, max_size=12))
def test_keys_that_begin_with_esc_are_those_keys_and_no_text_however_fast_they_come(data, strokes):
    got = read(data.draw(split("".join(sent for sent, _ in strokes))))
    assert keys(got) == [name for _, name in strokes]
    assert typed(got) == ""


@given(st.data(), texts)
def test_what_is_typed_comes_through_whole(data, text):
    assert typed(read(data.draw(split(text)))) == text


@given(st.data(), st.lists(st.tuples(texts, st.sampled_from([s for s in STROKES if len(s[0]) > 2 and s[0][-1] != "["]))))
def test_text_between_keys_comes_through_whole(data, parts):
    got = read(data.draw(split("".join(text + sent for text, (sent, _) in parts))))
    assert typed(got) == "".join(text for text, _ in parts)
    assert not parts or keys(got)[-1] == parts[-1][1][1]


@given(st.data(), st.text("\x1b[O]P_M<>?;:$~0127aAuRmy\x07\\ \x00\n^é", max_size=40))
def test_nothing_that_comes_stops_the_keys_that_follow(data, noise):
    clock = Clock()
    parser = KeyParser(clock=lambda: clock.now)
    for chunk in [*data.draw(split(noise)), "\x1b[201~"]:
        list(parser.feed(chunk))
    clock.now += 10
    list(parser.tick())
    assert typed(parser.feed("x")) == "x"


@given(st.data(), st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x00"), max_size=30))
def test_a_paste_comes_through_whole_with_all_that_is_in_it(data, text):
    if "\x1b[201~" in text:
        return
    got = read(data.draw(split(f"\x1b[200~{text}\x1b[201~")))
    assert [event.text for event in got if isinstance(event, events.Paste)] == [text]
    assert keys(got) == []


def test_esc_is_a_key_of_its_own_once_nothing_follows_it():
    clock = Clock()
    parser = KeyParser(clock=lambda: clock.now)
    assert keys(parser.feed(ESC)) == keys(parser.tick()) == []
    clock.now += 0.2
    assert keys(parser.tick()) == ["escape"]
    assert typed(parser.feed("g")) == "g"


def test_a_sequence_cut_by_a_slow_line_is_still_one_key():
    clock = Clock()
    parser = KeyParser(clock=lambda: clock.now)
    list(parser.feed("\x1b[1;"))
    clock.now += 0.5
    assert keys(parser.tick()) == []
    assert keys(parser.feed("3A")) == ["alt+up"]


@pytest.mark.parametrize(
    ("sent", "key", "text"),
    [
        ("\x1b[97;3u", "alt+a", ""),
        ("\x1b[97;3;97u", "alt+a", ""),
        ("\x1b[97;4;65u", "alt+shift+a", ""),
        ("\x1b[49;3u", "alt+1", ""),
        ("\x1b[115;9;115u", "super+s", ""),
        ("\x1b[97;3;229u", "å", "å"),
        ("\x1b[53;3;8734u", "infinity", "∞"),
        ("\x1b[113;7;64u", "at", "@"),
        ("\x1b[94;;94u", "circumflex_accent", "^"),
        ("\x1b[13;5u", "ctrl+enter", ""),
    ],
)
def test_a_key_of_kittys_protocol_is_a_command_unless_its_modifiers_make_another_character(sent, key, text):
    got = read([sent])
    assert (keys(got), typed(got)) == ([key], text)


@pytest.mark.parametrize(
    "sent",
    ["\x1b]11;rgb:1e1e/1e1e/1e1e\x07", "\x1b]11;rgb:0/0/0\x1b\\", "\x1bP1$r0m\x1b\\", "\x1b_Gi=1;OK\x1b\\", "\x1b[>0;276;0c"],
)
def test_an_answer_of_the_terminal_to_somebody_elses_question_is_no_text(sent):
    got = read([sent, "x"])
    assert (keys(got), typed(got)) == (["x"], "x")


def test_a_key_that_comes_in_an_answer_that_does_not_end_is_read():
    assert keys(read(["\x1b]11;rgb:0/0\x1b[A"])) == ["up"]


def test_the_mouse_the_focus_and_the_size_come_through():
    got = read(["\x1b[<0;5;7M\x1b[I\x1b[O\x1b[?2026;2$y\x1b[24;80R"])
    assert [type(event).__name__ for event in got] == [
        "MouseDown", "AppFocus", "AppBlur", "TerminalSupportsSynchronizedOutput", "CursorPosition",
    ]  # fmt: skip


@pytest.mark.parametrize("sent", ["\x00", "\x00\x1b\x00a", "\x1b[1\x00;5A", "\x00x\x00", "\x1b\x00"])
def test_shift_ctrl_and_alt_by_themselves_are_no_keys_on_windows(sent):
    """Its console sends NUL for them, which is Ctrl+Space elsewhere: whole columns would be selected, and filled."""
    parser = WindowsKeyParser(clock=lambda: 0.0)
    assert keys([*parser.feed(sent), *parser._give_up()]) == keys(read([sent.replace("\x00", "")]))
