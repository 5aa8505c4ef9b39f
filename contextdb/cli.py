"""The command line: parse, call, print. Each command is a module of `contextdb.commands`, imported when it is asked for.

A module that has `COMMANDS` instead of `run` is a group: the next word says which of its commands is meant.
"""

from __future__ import annotations

import argparse
import os
import sys
import textwrap
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import IO, Any, NoReturn

from contextdb.console import ExitCode, drop_output, note, printable
from contextdb.disk import unnameable
from contextdb.disk.boundary import TYPED_ROOT
from contextdb.disk.together import UnfinishedWarning
from contextdb.errors import ContextDBError, Fault, Place, in_quotes, joined, mend_for, nearest, some

COMMANDS = {
    "edit": "the editor, in the terminal or in a browser",
    "query": "which assets are valid for one context",
    "evaluate": "every context of a file: how many assets are valid in each",
    "check": "what is wrong with the tables",
    "coverage": "which contexts have a valid asset, and which have none",
    "cases": "what saved contexts reach of a table, and the fewest that reach the rest",
    "ci": "check and coverage as a build runs them, against a commit, with report files",
    "diff": "what changed between two versions of a table",
    "tidy": "fewer cells with the same answers",
    "merge": "merge two versions of a table",
    "git": "let git merge and show tables cell by cell",
    "import": "import a table from another program: CSV, Excel, JSON, DMN, Unreal",
    "export": "write a table for another program",
    "compile": "write the compiled file for the game",
    "live": "what a running game asks its tables, and what it picks",
    "index": "the rows of all projects below a folder as one Parquet file",
    "verify": "whether files are as contextdb wrote them",
    "motion": "motion databases: bones, check, build, search, select, run, replay, describe, prepare",
    "desktop": "open tables with a double click",
    "demo": "a tour of the sample tables",
    "play": "a small game whose characters obey tables, and the editor of its tables",
}


CRASH = "an error of contextdb itself. Please report it with these lines, which hold nothing of your files:"

_PLAIN = "\0--\0"
"""Before each argument behind "--": no argument of a process begins so, and argparse takes it for no option in any version."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors name the nearest thing that would have been right."""

    def parse(self, given: Sequence[str]) -> argparse.Namespace:
        """The arguments; options may be anywhere between the others, but none behind "--"."""
        at = given.index("--") if "--" in given else len(given)
        for text in given[:at]:
            if text.startswith("-") and text not in self._option_string_actions and os.path.isfile(text):
                fault = Fault(f"{in_quotes(text)} is a file, and looks like an option.", mend=in_quotes(os.path.join(".", text)))
                self.error(fault.message)
            if text not in self._option_string_actions and self._is_format(text):
                self._refuse(text)
        arguments, rest = self.parse_known_intermixed_args([*given[:at], *(_PLAIN + text for text in given[at + 1 :])])
        for action in self._get_positional_actions():
            if action.nargs is None and not isinstance(getattr(arguments, action.dest), str):  # what "--" makes of none
                self.error(f"the following arguments are required: {action.metavar}")
        for text in rest:
            if not text.startswith("-"):
                self.error(f"{in_quotes(text.removeprefix(_PLAIN))} is one argument too many.")
            self._refuse(text)
        return arguments

    def _is_format(self, text: str) -> bool:
        """Whether an argument is "--" and the name of a format of the command."""
        formats = self._option_string_actions.get("--format")
        return formats is not None and text.startswith("--") and text[2:] in (formats.choices or ())

    def _refuse(self, text: str) -> NoReturn:
        """Refuse an option that there is not, and name what was meant."""
        options = self._option_string_actions
        mend = in_quotes(f"--format {text[2:]}") if self._is_format(text) else mend_for(text.partition("=")[0], options)
        self.error(Fault(f"there is no option {in_quotes(text)}.", mend=mend).message)

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        return super()._get_values(action, [text.removeprefix(_PLAIN) for text in arg_strings])

    def print_help(self, file: IO[str] | None = None) -> None:  # type: ignore[override]
        """Print the help; where argparse would keep quiet about output that cannot be written, this does not."""
        print(self.format_help(), end="", file=file)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = [str(c) for c in action.choices]
            fault = Fault(f"there is no {in_quotes(str(value))}.", some(known, len(known)), mend_for(str(value), known))
            raise argparse.ArgumentError(action, fault.message)

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and how to see the help, and leave with code 2."""
        print(printable(f"{self.prog}: {message}"), file=sys.stderr)
        print(f'Try "{self.prog} --help".', file=sys.stderr)
        sys.exit(ExitCode.BAD_USE)


class Help(argparse.HelpFormatter):
    """Help whose paragraphs are wrapped to the terminal, and whose indented lines stay as they are."""

    def _format_action_invocation(self, action: argparse.Action) -> str:
        """`-o, --output FILE`, as from Python 3.13 on; before, `-o FILE, --output FILE`."""
        if sys.version_info >= (3, 13) or not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        values = self._format_args(action, self._get_default_metavar_for_optional(action))
        return f"{', '.join(action.option_strings)} {values}"

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = text.strip().split("\n\n")
        return "\n\n".join(p if p.startswith(" ") else textwrap.fill(" ".join(p.split()), width) for p in paragraphs)


@dataclass(frozen=True)
class Group:
    """Commands that begin with the same words: all of them, or those of `contextdb motion`."""

    words: tuple[str, ...]
    commands: Mapping[str, str]
    about: str | None = None

    @property
    def overview(self) -> str:
        return _overview(self.commands) if self.about is None else self._help()

    def command(self, name: str) -> ModuleType:
        """The module of a command; an unknown name is refused with the nearest."""
        if name in self.commands:
            return import_module(f"contextdb.commands.{'_'.join((*self.words, name))}_command")
        near = nearest(name, self.commands)
        mend = in_quotes(" ".join((*self.words, near))) if near else ""
        problem = f"there is no command {in_quotes(' '.join((*self.words, name)))}."
        raise ContextDBError(Fault(problem, joined(list(self.commands), 6), mend))

    def parser(self, name: str, command: ModuleType) -> Parser:
        parser = _new_parser((*self.words, name), command.__doc__)
        command.add_arguments(parser)
        limits = parser.add_argument_group("limits")
        limits.add_argument("--max-memory", type=_limit, metavar="MB", help="exit with 2 if it needs more memory (on Linux)")
        limits.add_argument("--max-time", type=_limit, metavar="S", help="exit with 2 after S seconds")
        project = parser.add_argument_group("project")
        about = "the folder up to which [project] extends may climb (default: the nearest with a .git)"
        project.add_argument("--root", metavar="FOLDER", help=about)
        return parser

    def _help(self) -> str:
        parser = _new_parser(self.words, self.about)
        parser.usage = f"{parser.prog} COMMAND …"
        listed = parser.add_argument_group("commands")
        for name, text in self.commands.items():
            listed.add_argument(name, help=text)
        return parser.format_help()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; gives the exit code. Errors of contextdb go to standard error, each fault on its line."""
    if arguments is None:
        _name_files_in_utf8()
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # nothing here multiplies large matrices: threads cost 50 ms for nothing
    given = list(sys.argv[1:] if arguments is None else arguments)
    _use_utf8()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UnfinishedWarning)
        code = _main(given)
    for warning in caught:
        if issubclass(warning.category, UnfinishedWarning):
            note(warning.message)
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    return code


def _main(given: Sequence[str]) -> int:
    try:
        code = _run(Group((), COMMANDS), given)
        sys.stdout.flush()
        return code
    except ContextDBError as error:
        return _failed(*error.faults)
    except BrokenPipeError:
        drop_output()
        return ExitCode.OK
    except OSError as error:
        drop_output()
        place = Place(str(error.filename)) if error.filename else Place("standard output")
        return _failed(Fault(f"{error.strerror or error}.", place=place))
    except UnicodeEncodeError as error:
        if error.encoding != sys.getfilesystemencoding() or error.encoding == "utf-8":
            return _crashed(error, given)
        return _failed(unnameable(error, Path(error.object)))
    except ImportError as error:
        return _failed(Fault(f"{error}.")) if error.name == "contextdb.core" else _crashed(error, given)
    except KeyboardInterrupt:
        note("interrupted")
        return ExitCode.INTERRUPTED
    except GeneratorExit:
        raise
    except BaseException as error:  # a panic of polars is no Exception
        return _crashed(error, given)


def _crashed(error: BaseException, given: Sequence[str]) -> ExitCode:
    """Report an error of contextdb's own, with what memory is left."""
    drop_output()
    with suppress(Exception):
        note(CRASH)
        from contextdb.commands import crash

        for line in crash.lines(error, given):
            print(printable(line), file=sys.stderr)
    return ExitCode.INTERNAL


def _failed(*faults: Fault) -> ExitCode:
    note(*faults)
    return ExitCode.BAD_USE


def _run(group: Group, given: Sequence[str]) -> int:
    if not given or given[0] in ("-h", "--help"):
        print(group.overview, end="", file=sys.stdout if given else sys.stderr)
        return ExitCode.OK if given else ExitCode.BAD_USE
    if given[0] == "--version" and not group.words:
        from contextdb.commands import installed
        from contextdb.console import __version__

        print(f"contextdb {__version__}", *installed.lines(), sep="\n")
        return ExitCode.OK
    if given[0] == "help":
        return _run(group, [*given[1:], "--help"])
    command = group.command(given[0])
    if hasattr(command, "COMMANDS"):
        return _run(Group((*group.words, given[0]), command.COMMANDS, command.__doc__), given[1:])
    from contextdb.console import announced

    try:
        takes_screen = group.words == () and given[0] == "edit"
        with nullcontext() if takes_screen else announced():
            arguments = group.parser(given[0], command).parse(given[1:])
            TYPED_ROOT.set(None if arguments.root is None else Path(arguments.root))
            if arguments.max_memory is None and arguments.max_time is None:
                return int(command.run(arguments))
            from contextdb.commands.limits import limited

            return limited(arguments, (*group.words, *given), lambda: int(command.run(arguments)))
    except SystemExit as leaving:  # how argparse ends after --help and after an error
        sys.stdout.flush()
        return int(leaving.code or 0)


def _new_parser(words: Sequence[str], about: str | None) -> Parser:
    prog = " ".join(("contextdb", *words))
    return Parser(prog=prog, description=about, formatter_class=Help, allow_abbrev=False)


def _limit(text: str) -> float:
    with suppress(ValueError):
        if 0.1 <= (number := float(text)) <= 1e9:
            return number
    raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a limit. Accepted: a number from 0.1 to 1e9.")


def _overview(commands: Mapping[str, str]) -> str:
    width = max(map(len, commands))
    lines = [f"  {name:<{width}}  {text}" for name, text in commands.items()]
    return (
        "usage: contextdb COMMAND …\n\n"
        + "\n".join(lines)
        + '\n\n"contextdb COMMAND --help" shows its options; --version prints the versions of contextdb and of what it uses.\n'
    )


def _name_files_in_utf8() -> None:
    """Start again in UTF-8 where the environment names files in ASCII.

    Else arguments, names of files and what contextdb.toml says of them would not be the same texts, and nobody could read the names
    in messages.
    """
    if sys.getfilesystemencoding() == "ascii" and sys.executable:
        os.execv(sys.executable, [sys.executable, "-X", "utf8", *sys.orig_argv[1:]])


def _use_utf8() -> None:
    """Write UTF-8 also where the terminal's encoding is another, and what is no character as its escape."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            is_utf8 = (stream.encoding or "").lower().replace("-", "") == "utf8"
            stream.reconfigure(encoding=None if is_utf8 else "utf-8", errors="backslashreplace")


if __name__ == "__main__":
    sys.exit(main())
