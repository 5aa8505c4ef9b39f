"""An editor that is to be killed: edits and saves a table without end, and tells on standard output what it does.

One process imports everything once and forks an editor for each line it reads: `SEED STEP`. With a step the editor kills itself at
that call to the system inside its saves and journal, a write only half done; without, whoever reads kills it. What it tells:

    about DIGEST    the table would then have these bytes
    done DIGEST     it has, and the journal has been told
    saving DIGEST   the file is about to have these bytes
    saved DIGEST    it has
    end             the editor is dead
"""

import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from saved_bytes import bytes_for

from contextdb.edits import edits
from contextdb.tables.changes import Edit
from contextdb.tables.table import Table
from tui.model.session import Session
from tui.model.watched import digest_of

SYSTEM_CALLS = ("open", "write", "fsync", "replace", "close", "link", "unlink")
TEXTS = ["Any", "0..5", "20, 9.99", 'say "no"', "zwei\nZeilen", "", "5;;3", "x" * 300]


def tell(*words: str) -> None:
    """Say something at once."""
    os.write(1, f"{' '.join(words)}\n".encode())


def edit_of(table: Table, chance: random.Random) -> Edit:
    """Any edit of a few kinds."""
    names = [c.name for c in table.columns]
    kind = chance.choice(["cells", "cells", "cells", "insert", "delete", "move"])
    row = chance.randrange(table.n_rows)
    if kind == "insert":
        return edits.insert_rows(table, row, [{names[0]: f"new_{chance.random()}"}])
    if kind == "delete" and table.n_rows > 20:
        return edits.delete_rows(table, [row])
    if kind == "move":
        return edits.move_rows(table, [row], chance.randrange(table.n_rows))
    cells = [(chance.randrange(table.n_rows), chance.choice(names), chance.choice(TEXTS)) for _ in range(chance.randrange(1, 9))]
    return edits.set_cells(table, cells, "Type")


def work(path: Path, chance: random.Random) -> None:
    """Edit and save for ever."""
    session = Session(path)
    tell("done", digest_of(bytes_for(session.sheet.table, path)))
    while True:
        if chance.random() < 0.25:
            raw = digest_of(bytes_for(session.sheet.table, path))
            tell("saving", raw)
            session.save()
            tell("saved", raw)
            continue
        edit = edit_of(session.sheet.table, chance)
        digest = digest_of(bytes_for(edit.apply(session.sheet.table), path))
        tell("about", digest)
        session.sheet.apply(edit)
        tell("done", digest)


def kill_at(step: int) -> None:
    """Have the process killed at that call of `SYSTEM_CALLS`; a write is cut in half then."""
    left = step
    real: dict[str, Callable[..., Any]] = {name: getattr(os, name) for name in SYSTEM_CALLS}

    def counted(name: str) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            nonlocal left
            if name == "write" and given[0] == 1:
                return real[name](*given)
            left -= 1
            if left < 0:
                if name == "write":
                    real[name](given[0], given[1][: len(given[1]) // 2])
                os.kill(os.getpid(), signal.SIGKILL)
            return real[name](*given, **more)

        return call

    for name in SYSTEM_CALLS:
        setattr(os, name, counted(name))


def main() -> None:
    """Fork an editor for each line."""
    path = Path(sys.argv[1])
    for line in iter(sys.stdin.readline, ""):
        seed, *step = map(int, line.split())
        child = os.fork()
        if not child:
            if step:
                kill_at(step[0])
            work(path, random.Random(seed))
        tell("started", str(child))
        os.waitpid(child, 0)
        tell("end")


if __name__ == "__main__":
    main()
