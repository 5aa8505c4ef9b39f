"""FBX and USD files, read by a child process: their libraries end the process now and then, which is then a fault of one file.

One child of a kind reads many files, and is started again when it dies. It ends by itself where it works for long on a small file,
and is given up when it says nothing for long.
"""

from __future__ import annotations

import atexit
import json
import os
import platform
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import IO, Any

import numpy as np

from contextdb.errors import ClipError, Fault, Place
from contextdb.motion.clips.joint_arrays import MOST_FRAME_JOINTS, MOST_JOINTS, depth_first, most_frame_joints
from contextdb.motion.clips.joint_worlds import JointWorlds

CHILD = Path(__file__).with_name("parser_child.py")
SILENCE_S = 20.0
"""So long a child may say nothing of a small file, on a machine that does other things too."""
STILL_S = 2.0
"""So long a child may sleep that has a whole file to read."""
BYTES_PER_S = 2e6
"""Of a large file it may be silent so much longer."""
WORK_S, BYTES_PER_WORK_S = 4.0, 5e4
"""So long it may work on a file, in seconds of CPU, and so many bytes more give it another one: a clip of a minute takes one."""
MOST_SENT = 1 << 25
"""Bytes of files after which a new child is started: libraries do not give all memory back."""
MOST_LINE = 1 << 24
THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "2"}
NO_WHEEL = "and none for 3.14 on Windows with x86-64"
Answer = tuple[dict[str, Any], bytes] | None


class ParserProcess:
    """The child of one kind, "fbx" or "usd"; `library` is what it needs, and `extra` installs it."""

    def __init__(self, kind: str, library: str, extra: str) -> None:
        self.kind, self.library, self.extra = kind, library, extra
        self.child: subprocess.Popen[bytes] | None = None
        self.folder: TemporaryDirectory[str] | None = None
        self.answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self.turn = threading.Lock()
        self.n_sent = 0

    def worlds(self, content: bytes, take: int, file: str) -> JointWorlds:
        """The joints of a take. Raises ClipError where the file cannot be read, the child dies or is silent, or the library is not
        installed."""
        with self.turn:
            try:
                about, data = self._asked(content, take)
            except BaseException as error:
                self.close()
                if isinstance(error, _Lost):
                    raise self._refused(str(error), file) from None
                raise
        if about.get("missing"):
            problem = f"{self.kind.upper()} files cannot be read: {self.library} is not installed."
            mend = f'to install it: pip install "contextdb[{self.extra}]"'
            if self.kind == "fbx" and not has_wheel(sys.platform, platform.machine(), sys.version_info[:2]):
                mend = f"ufbx has wheels for Python 3.11 to 3.14, {NO_WHEEL}: another Python, or the file as .glb"
            raise ClipError(Fault(problem, ".bvh, .glb and .npz, which need nothing more", mend, Place(file)))
        if "fault" in about:
            raise self._refused(str(about["fault"]), file)
        return _worlds(about, data)

    def _refused(self, problem: str, file: str) -> ClipError:
        return ClipError(Fault(problem, f"a whole {self.kind.upper()} file", "to export it again", Place(file)))

    def close(self) -> None:
        """End the child; the next file starts another."""
        child, self.child = self.child, None
        if child is not None and self.folder is not None:
            child.kill()
            with suppress(KeyboardInterrupt):  # whoever ends it for one raises it; at the end of the program it is no news
                child.wait()
            for stream in (child.stdin, child.stdout):
                if stream is not None:
                    with suppress(OSError):
                        stream.close()
            self.folder.cleanup()

    def _asked(self, content: bytes, take: int) -> tuple[dict[str, Any], bytes]:
        if self.n_sent > MOST_SENT:
            self.close()
        child = self._running()
        self.n_sent += len(content)
        sender = threading.Thread(target=_send, args=(child.stdin, content, take), daemon=True)
        sender.start()
        while True:
            try:
                answer = self._answer(child.pid, sender, SILENCE_S + len(content) / BYTES_PER_S)
            except queue.Empty:
                raise _Lost("the file was read for too long without an answer.") from None
            if answer is None:
                raise _Lost(_end_of(child))
            if "done" not in answer[0]:
                return answer

    def _answer(self, pid: int, sender: threading.Thread, silence_s: float) -> Answer:
        """The next answer. Raises queue.Empty after a silence, or where the child has all it needs and sleeps for STILL_S, as one
        may that gets no more memory."""
        start = asleep_since = monotonic()
        before = ""
        while (now := monotonic()) < start + silence_s:
            with suppress(queue.Empty):
                return self.answers.get(timeout=min(STILL_S / 4.0, start + silence_s - now))
            asleep = "" if sender.is_alive() else _asleep(pid)
            if not asleep or asleep != before:
                asleep_since, before = monotonic(), asleep
            elif monotonic() > asleep_since + STILL_S:
                break
        raise queue.Empty

    def _running(self) -> subprocess.Popen[bytes]:
        if self.child is None or self.child.poll() is not None:
            self.close()
            self.n_sent = 0
            self.folder = TemporaryDirectory(prefix="contextdb-", ignore_cleanup_errors=True)
            command = [sys.executable, "-P", str(CHILD), self.kind, self.folder.name]
            # Threads would take memory by the cores of the machine; a library that dies writes a report.
            alone = {**os.environ, **THREADS, "TMPDIR": self.folder.name}
            pipe, nowhere = subprocess.PIPE, subprocess.DEVNULL
            self.child = subprocess.Popen(command, env=alone, stdin=pipe, stdout=pipe, stderr=nowhere)
            self.answers = queue.SimpleQueue()
            threading.Thread(target=_receive, args=(self.child.stdout, self.answers), daemon=True).start()
        return self.child


class _Lost(Exception):
    """The child gives no answer."""


def _asleep(pid: int) -> str:
    """How long a process has worked, where it sleeps; nothing where it does not, or that is not known here."""
    try:
        state, *rest = Path(f"/proc/{pid}/stat").read_text("ascii", "replace").rpartition(")")[2].split()
    except (OSError, ValueError):
        return ""
    return " ".join(rest[10:12]) if state == "S" else ""


def _end_of(child: subprocess.Popen[bytes]) -> str:
    """Why a child gives no more answers."""
    try:
        code = child.wait(1.0)
    except subprocess.TimeoutExpired:
        return "the process that read the file answered what is no clip."
    if hasattr(signal, "SIGPROF") and code == -signal.SIGPROF:
        return "the file takes longer to read than a file of its size may."
    return f"the process that read the file ended (exit code {code})."


def _send(stream: IO[bytes] | None, content: bytes, take: int) -> None:
    assert stream is not None
    size = len(content)
    most = {"joints": MOST_JOINTS, "frame_joints": most_frame_joints(size), "seconds": WORK_S + size / BYTES_PER_WORK_S}
    with suppress(OSError, ValueError):  # the child died, which the other thread reports
        stream.write(json.dumps({"size": size, "take": take, **most}).encode() + b"\n")
        stream.write(content)
        stream.flush()


def _receive(stream: IO[bytes] | None, answers: queue.SimpleQueue[Answer]) -> None:
    """Pass on what a child answers; None at its end, or where it does not answer as agreed."""
    assert stream is not None
    with suppress(OSError, ValueError, TypeError, KeyError):
        while line := stream.readline(MOST_LINE):
            about = json.loads(line)
            size = _size(about)
            data = stream.read(size)
            if len(data) < size:
                break
            answers.put((about, data))
    answers.put(None)


def _size(about: Mapping[str, Any]) -> int:
    """How many bytes follow an answer."""
    if "frames" not in about:
        return 0
    joints, frames = len(about["names"]), int(about["frames"])
    if not (0 <= joints <= MOST_JOINTS and frames >= 0 and joints * frames <= MOST_FRAME_JOINTS):
        raise ValueError("more than a clip")
    return 8 * 16 * joints * (1 + frames)


def _worlds(about: Mapping[str, Any], data: bytes) -> JointWorlds:
    n, n_frames = len(about["names"]), int(about["frames"])
    numbers = np.frombuffer(data, "<f8").astype(np.float64).reshape(1 + n_frames, n, 4, 4)
    parents = np.array(about["parents"], np.int64)
    assert len(depth_first(parents)) == n, "the child sends trees"
    names = [str(name) for name in about["names"]]
    return JointWorlds(names, parents, numbers[0], numbers[1:], np.array(about["deforms"], bool), float(about["rate"]))


def has_wheel(system: str, machine: str, version: tuple[int, int]) -> bool:
    """Whether the extra fbx installs ufbx there: PyPI has it ready for a Python of such a version."""
    return version < ((3, 14) if (system, machine) == ("win32", "AMD64") else (3, 15))


def parser(kind: str) -> ParserProcess:
    """The child of a kind, of this process: one that was forked starts its own."""
    return _parser(kind, os.getpid())


@cache
def _parser(kind: str, _pid: int) -> ParserProcess:
    started = ParserProcess(kind, *{"fbx": ("ufbx", "fbx"), "usd": ("usd-core", "usd")}[kind])
    atexit.register(started.close)
    return started
