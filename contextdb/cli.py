"""The command line: parse, call, print. Each command is a module of `contextdb.commands`, imported when it is asked for."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from contextdb.errors import ContextDBError, Fault, in_quotes, nearest
from contextdb.exit_codes import ExitCode

COMMANDS = {
    "query": "which assets are valid for one context",
    "evaluate": "every context of a file: how many assets are valid in each",
    "check": "what is wrong with the tables",
    "compile": "write the binary artefact for the game",
    "demo": "the whole way on the sample tables",
}


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors name the nearest thing that would have been right."""

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and how to see the help, and leave with code 2."""
        print(f"{self.prog}: {message}", file=sys.stderr)
        print(f'Try "{self.prog} --help".', file=sys.stderr)
        sys.exit(ExitCode.BAD_USE)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; gives the exit code. Errors of contextdb go to standard error, each fault on its line."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    _use_utf8()
    try:
        return _run(given)
    except ContextDBError as error:
        for fault in error.faults:
            print(f"contextdb: {fault}", file=sys.stderr)
        return ExitCode.BAD_USE
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.OK
    except KeyboardInterrupt:
        print("contextdb: interrupted", file=sys.stderr)
        return ExitCode.INTERRUPTED


def _run(given: Sequence[str]) -> int:
    if not given or given[0] in ("-h", "--help", "help"):
        print(_overview(), end="")
        return ExitCode.OK if given else ExitCode.BAD_USE
    if given[0] == "--version":
        from contextdb import __version__

        print(f"contextdb {__version__}")
        return ExitCode.OK
    name = given[0]
    if name not in COMMANDS:
        near = nearest(name, COMMANDS)
        raise ContextDBError(Fault(f"there is no command {in_quotes(name)}.", ", ".join(COMMANDS), in_quotes(near) if near else ""))
    command = import_module(f"contextdb.commands.{name}_command")
    own = Parser(prog=f"contextdb {name}", description=command.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    command.add_arguments(own)
    return int(command.run(own.parse_intermixed_args(given[1:])))


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {text}" for name, text in COMMANDS.items()]
    return (
        "usage: contextdb COMMAND …\n\n"
        + "\n".join(lines)
        + '\n\n"contextdb COMMAND --help" tells more of one; --version prints the version.\n'
    )


def _use_utf8() -> None:
    """Write UTF-8 where the terminal's encoding could not take a name; a pipe on Windows is such a place."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure") and (stream.encoding or "").lower().replace("-", "") != "utf8":
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")


if __name__ == "__main__":
    sys.exit(main())
