"""What a command may take: `--max-memory` and `--max-time`. An edge: processes, signals, the system's limits.

A limited command runs in a process of its own, which the first one watches: where the system refuses memory, compiled code of other
packages ends the process without asking Python, and a compiled loop does not look at the clock. At a limit the command is
interrupted, which takes back what it is writing; where it does not end by itself, it is killed, and the next save in the folder
deletes its temporary files.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Timer
from types import FrameType

from contextdb.console import ScreenCrash
from contextdb.errors import ContextDBError, Fault

WATCHED = "CONTEXTDB_WATCHED"
"""In the environment of a process that another one watches."""
GRACE_S = 5.0
"""So long a process may take to end after it was interrupted."""
POLL_S = 0.01
HEADROOM_BYTES = 1 << 30
"""How much more than its limit a process may reserve without using it, as the stacks of threads."""
OUT_OF_TIME, OUT_OF_MEMORY = 124, 125
"""Exit codes of a watched process; nobody else sees them."""
if sys.platform == "win32":
    _INTERRUPT = signal.SIGBREAK
else:
    _INTERRUPT = signal.SIGALRM
_START = "import sys; sys.path.append(sys.argv.pop(1)); from contextdb.cli import main; sys.exit(main())"
_ROOT = Path(__file__).parents[2]


class LimitError(ContextDBError):
    """A command needs more than it may take."""


class _Interrupted(KeyboardInterrupt):
    """A limit is reached: whatever is interrupted by a user is interrupted by this."""


def limited(arguments: argparse.Namespace, words: Sequence[str], run: Callable[[], int]) -> int:
    """Run a command, which the `words` name, in its limits; gives its exit code, or raises LimitError."""
    if arguments.max_memory is not None and sys.platform != "linux":
        raise LimitError(Fault("--max-memory is not supported on this system.", "it on Linux"))
    if os.environ.pop(WATCHED, None) is None:
        return _watch(arguments.max_memory, arguments.max_time, words)
    return _run_within(arguments.max_memory, arguments.max_time, run)


# ---- the watched process


def _run_within(most_mb: float | None, most_s: float | None, run: Callable[[], int]) -> int:
    reached = Event()

    def interrupt(_: int, frame: FrameType | None) -> None:
        reached.set()
        raise _Interrupted

    signal.signal(_INTERRUPT, interrupt)
    if most_mb is not None:
        _limit_memory(most_mb)
    timer = Timer(most_s or 0.0, _interrupt_main)
    timer.daemon = True
    if most_s is not None:
        timer.start()
    try:
        code = run()
        return OUT_OF_TIME if reached.is_set() else code
    except _Interrupted:
        return OUT_OF_TIME
    except (MemoryError, ScreenCrash) as error:
        if most_mb is None or not (isinstance(error, MemoryError) or isinstance(error.cause, MemoryError)):
            raise
        return OUT_OF_MEMORY
    finally:
        timer.cancel()


def _interrupt_main() -> None:
    """From another thread: also where the main thread waits for the system."""
    if sys.platform == "win32":
        signal.raise_signal(_INTERRUPT)
    else:
        os.kill(os.getpid(), _INTERRUPT)


def _limit_memory(most_mb: float) -> None:
    """Let the system refuse one allocation that is far too large; what grows is measured by who watches."""
    if sys.platform == "linux":
        import resource

        # Compiled code of other packages writes its last words to the number 2, Python to another.
        sys.stderr = open(os.dup(2), "w", buffering=1, encoding="utf-8", errors="backslashreplace")  # noqa: SIM115
        vars(sys)["__stderr__"] = sys.stderr  # where Textual paints
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 2)
        os.close(nowhere)
        most = int(most_mb * 1e6) + HEADROOM_BYTES
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # the aborts of other libraries would write what is in memory
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


# ---- the watching process


def _watch(most_mb: float | None, most_s: float | None, words: Sequence[str]) -> int:
    sys.stdout.flush()
    command = [sys.executable, "-P", "-c", _START, str(_ROOT), *words]
    process = subprocess.Popen(command, env={**os.environ, WATCHED: "1"})
    with suppress(ValueError):  # only the main thread may
        for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
            signal.signal(number, lambda number, _: process.send_signal(number))
    most_bytes = None if most_mb is None else most_mb * 1e6
    until_s = None if most_s is None else time.monotonic() + most_s + GRACE_S
    is_over = False
    while (code := _code(process)) is None:
        if most_bytes is not None and not is_over and _resident_bytes(process.pid) > most_bytes:
            process.send_signal(_INTERRUPT)
            is_over, until_s = True, time.monotonic() + GRACE_S
        if until_s is not None and time.monotonic() > until_s:
            process.kill()
            code = OUT_OF_TIME
            process.wait()
            break
    if is_over or code == OUT_OF_MEMORY or (code in _ABORTED and most_mb is not None):
        raise LimitError(Fault(f"the command needs more memory than the {most_mb:,g} MB of --max-memory."))
    if code == OUT_OF_TIME:
        raise LimitError(Fault(f"the command needs more time than the {most_s:g} s of --max-time."))
    return code if code >= 0 else 128 - code


_ABORTED = (-signal.SIGABRT, -signal.SIGSEGV, -getattr(signal, "SIGKILL", signal.SIGABRT))
"""How a process ends whose compiled code got no memory, or that the system killed for want of it."""


def _code(process: subprocess.Popen[bytes]) -> int | None:
    """The exit code; None while it runs."""
    try:
        return process.wait(POLL_S)
    except (subprocess.TimeoutExpired, KeyboardInterrupt):  # a key that interrupts goes to both processes
        return None


def _resident_bytes(process: int) -> int:
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):  # it has ended
        return 0
