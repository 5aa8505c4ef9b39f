"""Every option of every command: what holds when it is not given is what its help says, and no two options disagree about it."""

import argparse
import re
from collections.abc import Iterator

from strategies import for_each

from contextdb.cli import COMMANDS, Group

SAID = re.compile(r"\(default(?:: (.+?))?\)|; default: (.+?)\)")
"""How a help says what holds when an option is not given; alone, that the option is what holds."""
COMPUTED = {
    "next to each table", "the sample tables", "those that came with contextdb", "tables/, or here", "detected",
    "detected from its cells", "OURS", "next to contextdb.toml", "the rate of the features", "the clip's own path",
    "contextdb, or the Python that runs now", "as recorded", "whole, except in our own workbooks", "from the settings",
    "200,000, fewer above 500 conditions", "as the project says, else by size", "as the project says, else in which bodies stand",
    "as the project says, else that",
    "joined", "the first that decides", "the nearest with a .git",
}  # fmt: skip
"""What is worked out by the command: the parsed value is then None."""


def parsers(group: Group) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        if hasattr(command, "COMMANDS"):
            yield from parsers(Group(words, command.COMMANDS, command.__doc__))
        else:
            yield " ".join(words), group.parser(name, command)


PARSERS = dict(parsers(Group((), COMMANDS)))


def actions(command: str) -> list[argparse.Action]:
    return [action for action in PARSERS[command]._actions if action.dest != "help"]


def wrong(action: argparse.Action, holds: object) -> str:
    """What is wrong with what the help of an option says, given what holds without it."""
    found = SAID.search(action.help or "")
    if found is None:
        is_off = holds in (None, False, "", []) or (action.nargs == 0 and holds != action.const)
        return "" if is_off else f"{holds} holds, and the help does not say so"
    said = found[1] or found[2]
    if said is None:
        return "" if action.const == holds else f"{action.option_strings} is called the default, and {holds} holds"
    if holds is None:
        return "" if said in COMPUTED else f"the help says {said}, and nothing holds"
    return "" if said.replace(",", "") == str(holds) else f"the help says {said}, and {holds} holds"


@for_each(PARSERS)
def test_what_holds_when_an_option_is_not_given_is_what_its_help_says(command: str):
    parser = PARSERS[command]
    needed = [a for a in actions(command) if a.required]
    words = [word for a in needed for word in ([a.option_strings[-1], "x"] if a.option_strings else ["x"])]
    parsed = vars(parser.parse_known_intermixed_args(words)[0])
    said = {a.dest: wrong(a, parsed[a.dest]) for a in actions(command) if a not in needed}
    if command == "motion replay":
        assert said.pop("view")  # its default holds with --at alone
    assert {dest: text for dest, text in said.items() if text} == {}


@for_each(PARSERS)
def test_no_two_options_disagree_about_what_holds_without_them(command: str):
    defaults: dict[str, set[str]] = {}
    for action in actions(command):
        if action.default is not argparse.SUPPRESS:
            defaults.setdefault(action.dest, set()).add(repr(action.default))
    assert {dest: each for dest, each in defaults.items() if len(each) > 1} == {}


def test_a_help_that_says_otherwise_would_be_seen():
    parser = argparse.ArgumentParser()
    option = parser.add_argument("--k", type=int, default=3, help="so many (default: 4)")
    local = parser.add_argument("--local", action="store_false", dest="is_global", help="here (default)")
    silent = parser.add_argument("--n", type=int, default=3, help="so many")
    nothing = parser.add_argument("--m", type=int, help="so many (default: 4)")
    assert all([wrong(option, 3), wrong(local, True), wrong(silent, 3), wrong(nothing, None)])
