"""Processes of Python that start in milliseconds: one process has loaded what they need, and forks for each of them.

`python(...)` gives the words that start one. It has a folder, an environment, streams, signals and an exit code of its own, as any
other process; when the one that was started is killed, it is too, soon after. What is loaded, how the interpreter starts and ends
and what a terminal controls differ: tests of those start `sys.executable` themselves. So does every test with EXAMPLES=full, where
there is no fork, and where lines are counted.
"""

import atexit
import contextlib
import gc
import importlib
import io
import marshal
import os
import runpy
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
import types
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

HERE = Path(__file__).parent
STREAMS = "stdin", "stdout", "stderr"
LOADED = (
    "polars",
    "contextdb.cli",
    "contextdb.motion",
    "tui.app",
    *(
        f"contextdb.commands.{name}_command"
        for name in ("check", "coverage", "evaluate", "import", "live", "motion_build", "query")
    ),
)
IS_WARM = hasattr(os, "fork") and os.environ.get("EXAMPLES", "few") in ("", "few") and "COVERAGE_PROCESS_CONFIG" not in os.environ


def python(*words: str | Path) -> list[str]:
    """The command that runs Python with `-m MODULE` or `-c SCRIPT` and arguments."""
    if not IS_WARM:
        return [sys.executable, *map(str, words)]
    return [sys.executable, "-S", str(HERE / "warm_client.py"), _address(), *map(str, words)]


@cache
def _address() -> str:
    """Where the process listens that forks; it ends with this one."""
    folder = tempfile.mkdtemp()
    address = os.path.join(folder, "s")
    server = subprocess.Popen([sys.executable, __file__, address], stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=HERE.parent)
    assert server.stdin is not None
    assert server.stdout is not None

    @atexit.register
    def end() -> None:
        server.communicate()
        shutil.rmtree(folder, ignore_errors=True)

    server.stdout.readline()
    return address


# ---- the process that forks


def serve(address: str) -> None:
    """Fork for everyone who connects, until standard input ends."""
    sys.path[0] = str(HERE.parent)
    for name in LOADED:
        importlib.import_module(name)
    del sys.path[0]
    gc.collect()
    gc.freeze()
    woken, wakes = socket.socketpair()
    wakes.setblocking(False)
    signal.set_wakeup_fd(wakes.fileno())
    signal.signal(signal.SIGCHLD, lambda *_: None)
    links: dict[socket.socket, int] = {}
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        listener.listen(64)
        print(flush=True)
        while 0 not in (ready := select.select([0, listener, woken, *links], [], [])[0]):
            for link in links.keys() & ready:
                os.kill(links[link], signal.SIGKILL)  # the one that was started is gone
            if woken in ready or links.keys() & ready:
                woken.recv(1000)
                _tell_ends(links)
            if listener in ready:
                link, process = _forked(listener.accept()[0], [listener, woken, wakes, *links])
                links[link] = process


def _tell_ends(links: dict[socket.socket, int]) -> None:
    for link, process in list(links.items()):
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            with contextlib.suppress(OSError):
                link.sendall(os.waitstatus_to_exitcode(status).to_bytes(4, "big", signed=True))
            link.close()
            del links[link]


def _forked(link: socket.socket, others: list[socket.socket]) -> tuple[socket.socket, int]:
    """The process that was asked for."""
    size, handles, _, _ = socket.recv_fds(link, 4, 3)
    told = b""
    while len(told) < int.from_bytes(size, "big"):
        told += link.recv(1 << 16)
    process = os.fork()
    if not process:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for other in (link, *others):
            other.close()
        for number, handle in enumerate(handles):
            os.dup2(handle, number)
            os.close(handle)
        _be(*marshal.loads(told))
    for handle in handles:
        os.close(handle)
    link.sendall(process.to_bytes(4, "big"))
    return link, process


def _be(folder: bytes, environment: dict[bytes, bytes], words: list[str], streams: list[tuple[str, str, bool, bool]]) -> NoReturn:
    """Be a process of its own, to its end."""
    os.chdir(folder)
    os.environb.clear()
    os.environb.update(environment)
    is_unbuffered = words[0] == "-u"
    if is_unbuffered:
        del words[0]
    for number, (name, (encoding, errors, is_by_lines, is_direct)) in enumerate(zip(STREAMS, streams, strict=True)):
        raw: Any = open(number, "rb" if number == 0 else "wb", 0 if number and (is_direct or is_unbuffered) else -1, closefd=False)  # noqa: SIM115
        text = io.TextIOWrapper(raw, encoding, errors, line_buffering=is_by_lines, write_through=is_direct or is_unbuffered)
        setattr(sys, name, text)
    code = _code(words)
    threading._shutdown()
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            traceback.print_exc()
            code = 120
    os._exit(code)


def _code(words: list[str]) -> int:
    """The exit code of what the words run."""
    sys.path[:0] = ["", *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    sys.argv = words if words[0] not in ("-m", "-c") else [words[0], *words[2:]]
    try:
        if words[0] == "-m":
            sys.path[0] = os.getcwd()
            runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        elif words[0] == "-c":
            main = sys.modules["__main__"] = types.ModuleType("__main__")
            exec(compile(words[1], "<string>", "exec"), vars(main))
        else:
            sys.path[0] = os.path.dirname(words[0])
            runpy.run_path(words[0], run_name="__main__")
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        print(end.code, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        traceback.print_exc()
        return 128 + signal.SIGINT
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    serve(sys.argv[1])
