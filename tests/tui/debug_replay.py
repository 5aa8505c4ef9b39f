"""Replay files of the debugger, in replays/debug: the commands of `replay.py`, on a session of a project of made clips.

    session [COLUMNS ROWS]      open it, in a terminal of 80 x 24 or that size
    press, type, click, screen, file    as there; a file is one of the project

`python tests/tui/update_replays.py` writes what is shown now into these files too.
"""

import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent.parent)]

from motion_project import write_project  # noqa: E402
from replay import Replay, ReplayError, Step, _text  # noqa: E402
from running import run  # noqa: E402
from terminal import drive  # noqa: E402

from contextdb.commands.motion_replay_command import databases_of  # noqa: E402
from contextdb.motion import Trace  # noqa: E402
from tui.debug.app import DebugApp  # noqa: E402
from tui.debug.recording import Recording  # noqa: E402

FILES = sorted((HERE / "replays" / "debug").glob("*.keys"))


class DebugReplay(Replay):
    """The debugger, driven by the steps of a file."""

    def shown(self, steps: list[Step]) -> list[Step]:
        """The steps with what is shown now."""
        opening, *rest = steps
        if opening.command != "session":
            raise ReplayError("the first line is `session`")
        self._make()
        file = str(self.folder / "session.parquet")
        trace = Trace.load(file)
        databases, _ = databases_of(trace, None, file)
        recording = Recording("session.parquet", trace, str(self.folder / "game"), databases, trace.use(databases))
        app: Any = DebugApp(recording, measures=False)
        self.app = app
        columns, rows = map(int, opening.rest.split() or (80, 24))
        return [opening, *drive(app, lambda pilot: self._all(pilot, rest), (columns, rows))]

    def _make(self) -> None:
        write_project(self.folder / "game")
        session = ("player", str(self.folder / "stick.csv"), "--out", str(self.folder / "session.parquet"))
        assert run("motion", "run", str(self.folder / "game"), *session).code == 0
        self.at_first = {"contextdb.toml": _text(self._path("contextdb.toml"))}

    def _lines(self) -> list[str]:
        return [line.replace(str(self.folder), "FOLDER") for line in super()._lines()]

    def _path(self, name: str) -> Path:
        return self.folder / "game" / name
