"""Write docs/keys.md: every command of the editor and of the debugger with its keys, the keys of each tab and dialog, and what
terminals send for each, out of the lists and bindings that the program itself uses.

python docs/keys.py
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from textual.binding import Binding
from textual.dom import DOMNode

sys.path.insert(0, str(Path(__file__).parent.parent))

import tui
from docs import terminals
from tui.commands import COMMANDS, Command, key_names
from tui.debug.keys import KEYS, names_of

PAGE = Path(__file__).parent / "keys.md"
HEAD = """# Keys

Every command of [the editor](editor.md): its keys, and its name for a [file of your own
keys](editor.md#keys-and-colours-of-your-own). The first key of each works in every terminal, the others [where the terminal sends
them](#what-terminals-send). A command without keys is in the palette (Ctrl+P) or in the toolbar.
"""
SECTIONS = {
    "While a cell is edited": ("CellEditor", "Entry"),
    "Bars over the table": ("SheetBar", "FindBar", "AssetsPane"),
    "Every list": ("LineList",),
    "Tab Options": ("OptionsPane",),
    "Tab Priorities": ("PrioritiesPane",),
    "Tab Coverage": ("CoveragePane", "GapList", "RowList", "PairMap", "HeatMap"),
    "Tab Problems": ("ProblemsPane", "ProblemList"),
    "Tab Contracts": ("ContractsPane", "ContractList"),
    "Rows below a list": ("RowsBelow",),
    "Tab Motion": ("MotionPane", "SessionList"),
    "Every dialog": ("Dialog", "AskDialog", "ChooseDialog", "StepsDialog"),
    "A question": ("SureDialog",),
    "Help": ("HelpPage",),
    "All columns": ("ColumnsDialog",),
    "Sheet of columns": ("ColumnSheetDialog",),
    "Values of a column": ("ValuesDialog",),
    "Add column": ("AddColumn",),
    "Blueprints": ("Blueprints",),
    "Autofill": ("AutofillDialog",),
    "Find in all tables": ("FindEverywhere",),
    "What changes": ("ChangesDialog",),
    "Next picks": ("NextPicksDialog",),
    "Git history": ("RowHistoryDialog",),
    "Why, and nearest rows": ("NearestDialog",),
    "Actors": ("ActorsDialog",),
    "Contexts": ("ContextsDialog",),
    "Save the test row": ("KeepDialog",),
    "Open a file of contexts": ("OpenDialog",),
    "Follow a game": ("LiveDialog",),
    "Import": ("ImportDialog", "RowsDialog"),
    "Remarks of an import": ("RemarksDialog",),
    "Export": ("ExportDialog",),
    "Unsaved edits": ("LeavingDialog",),
    "The table is open elsewhere": ("HeldDialog",),
    "The file was changed on disk": ("ConflictsDialog",),
    "Panes of the debugger": ("Bars", "CursorLines", "Stage"),
    "Help of the debugger": ("HelpPage", "DebugHelp"),
    "The debugger before a session is read": ("WaitingScreen",),
}
"""The widgets of each section; those of the commands and of the debugger's list have theirs."""
LISTED = ("Grid", "MainScreen", "EditorApp", "DebugScreen")
WORDS = {"↑": "up", "↓": "down", "←": "left", "→": "right", "Enter": "enter", "Esc": "escape", "Tab": "tab", "Space": "space"}
WORDS |= {"Del": "delete"} | {f"F{n}": f"f{n}" for n in range(1, 13)}
SENT = """## What terminals send

Keys that some terminal keeps for itself, or sends as another. *xterm* is also what tmux, screen and most terminals send; *kitty*
is kitty's keyboard protocol, which the editor turns on; *Windows* is Windows Terminal. `^A` is a control character. Kitty keeps
most keys with Ctrl+Shift for itself, Windows Terminal, once its window is split, Alt and Alt+Shift with arrows.
"""
SAME = {"Up", "Down", "Left", "Right", "Page up", "Page down", "First", "Last", "Cancel", "Close", "OK", "Choose"}
"""What keys do wherever they do anything: said once, with the keys of every list and dialog."""
EVERYWHERE = ("Every list", "Every dialog")
WAYS = {
    "one cell": ("up", "down", "left", "right"),
    "to the first or last cell of the row": ("home", "end"),
    "to the first or last cell of all": ("first", "last"),
    "a page": ("page-up", "page-down"),
}
"""The directions in which commands go and select: those of one kind stand on one line."""
TABS = "## In tabs and dialogs\n"


def page() -> str:
    """The page as it should be now."""
    groups = dict.fromkeys(command.group for command in COMMANDS)
    named = [(title, names) for title, names in SECTIONS.items() if _is_listed(names)]
    others = [_of_widgets(title, [rows for name in names for rows in rows_of(name)]) for title, names in named]
    return "\n".join([HEAD, *(_section(group) for group in groups), _debugger(), TABS, *filter(None, others), "", _sent()])


def _is_listed(names: tuple[str, ...]) -> bool:
    """Whether the page has the keys of these widgets: a dialog shows its own at its foot, and the page those of every dialog."""
    return "Dialog" in names or not any(issubclass(widgets()[name], widgets()["Dialog"]) for name in names)


@functools.cache
def widgets() -> dict[str, type[DOMNode]]:
    """Every widget with keys of its own."""
    for module in pkgutil.walk_packages(tui.__path__, "tui."):
        importlib.import_module(module.name)
    ours = [one for one in _below(DOMNode) if one.__module__.startswith("tui.")]
    return {one.__name__: one for one in ours if vars(one).get("BINDINGS") or "keys_text" in vars(one)}


def rows_of(name: str) -> Iterator[tuple[str, str]]:
    """The keys of a widget, those for one thing with commas between, and what they do: what is bound, then what its foot says."""
    widget = widgets()[name]
    bound: dict[tuple[str, str], list[str]] = {}
    for binding in Binding.make_bindings(vars(widget).get("BINDINGS", ())):
        bound.setdefault((binding.action, binding.description), []).append(binding.key)
    for (_, about), keys in bound.items():
        yield ",".join(keys), about
    for keys, about in told(str(vars(widget).get("keys_text", ""))):
        if not {key for some in bound.values() for key in some} & set(keys.split(",")):
            yield keys, about


def told(foot: str) -> Iterator[tuple[str, str]]:
    """The keys and what they do in a text such as "↑↓ choose · Esc"."""
    for part in foot.split(" · "):
        words = re.sub(r"([↑↓←→])(?=\S)", r"\1 ", part).split()
        n = next((at for at, word in enumerate(words) if word not in WORDS and not re.fullmatch("[A-Z]", word)), len(words))
        if n:
            keys = [WORDS.get(word, word.lower()) for word in words[:n]]
            yield ",".join(keys), " ".join(words[n:]) or ("close" if keys == ["escape"] else "choose")


def all_keys() -> list[str]:
    """Every key of the page, once."""
    of_commands = [command.keys for command in COMMANDS] + [key.keys for key in KEYS] + ["tab,shift+tab"]
    of_widgets = [keys for names in SECTIONS.values() for name in names for keys, _ in rows_of(name)]
    keys = [key for some in of_commands + of_widgets for key in some.split(",") if key]
    first: dict[str, str] = {}
    for key in keys:
        first.setdefault(terminals.name(key), key)
    return list(first.values())


def _below(widget: type[DOMNode]) -> Iterator[type[DOMNode]]:
    for one in widget.__subclasses__():
        yield one
        yield from _below(one)


def _section(group: str) -> str:
    families: dict[str, list[Command]] = {}
    for command in COMMANDS:
        if command.group == group:
            families.setdefault(_does(command), []).append(command)
    lines = [_line(does, family) for does, family in families.items()]
    return "\n".join([f"## {group}", "", *lines, ""])


def _does(command: Command) -> str:
    """What a command does, the same for those that differ only in their direction."""
    verb, _, rest = command.id.partition("-")
    is_end = rest.endswith("-end")
    where = next((where for where, names in WAYS.items() if rest.removesuffix("-end") in names), "")
    where = "to the end of the filled cells" if is_end else where
    return f"{verb.capitalize()} {where}." if where and verb in ("go", "select") else command.about


def _debugger() -> str:
    """The keys of the debugger, which have no names."""
    lines = [f"- {_shown(key.keys)}: {key.about}" for key in KEYS]
    about = (
        "Of [the debugger](sessions.md#see-why-the-debugger). Arrows up and down move the cursor of the pane that has the focus."
    )
    return "\n".join(["## In the debugger", "", about, "", *lines, ""])


def _of_widgets(title: str, rows: list[tuple[str, str]]) -> str:
    """The keys of some widgets on one line, without those that do what they do everywhere."""
    merged: dict[str, list[str]] = {}
    for keys, about in rows:
        about = about[:1].upper() + about[1:]
        if title in EVERYWHERE or about not in SAME:
            merged.setdefault(about, []).extend(terminals.name(key) for key in keys.split(","))
    parts = [f"**{', '.join(dict.fromkeys(names))}** {about}" for about, names in merged.items()]
    return f"- {title}: {'; '.join(parts)}" if parts else ""


def _sent() -> str:
    lines = [terminals.line(key) for key in all_keys() if not terminals.is_read_everywhere(key)]
    return "\n".join([SENT, "| key | xterm | kitty | Windows |", "| --- | --- | --- | --- |", *lines, ""])


def _shown(keys: str) -> str:
    return ", ".join(f"`{name}`" for name in names_of(keys).split("  "))


def _line(does: str, family: list[Command]) -> str:
    keys = ", ".join(name for command in family for name in key_names(command.keys))
    names = " ".join(f"`{command.id}`" for command in family)
    return f"- **{keys}** {names}: {does}" if keys else f"- {names}: {does}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
