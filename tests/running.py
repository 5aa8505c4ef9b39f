"""Runs commands as a shell would, inside this process or in one of their own."""

import contextlib
import io
import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from warm_start import python

from contextdb.cli import main

ROOT = Path(__file__).parent.parent


@dataclass(frozen=True)
class Result:
    """What a command left: its exit code, and what stands on standard output and standard error."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """The lines of standard output."""
        return self.out.splitlines()

    @property
    def json(self) -> Any:
        """Standard output as one JSON document."""
        return json.loads(self.out)


def run(*arguments: str | Path) -> Result:
    """Run a command in this process, with its output in memory."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(a) for a in arguments])
    return Result(int(code), *(stream.buffer.getvalue().decode() for stream in (out, err)))


def run_process(*arguments: str | Path, **more: Any) -> Result:
    """Run a command in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **more.pop("env", {})}
    command = python("-m", "contextdb", *arguments)
    done = subprocess.run(command, capture_output=True, env=environment, encoding="utf-8", **more)
    return Result(done.returncode, done.stdout, done.stderr)
