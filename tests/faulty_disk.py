"""A disk that fails at a call: every module that writes sees this in place of `os`. It counts the calls, and one of them fails."""

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import pytest

from contextdb import disk
from contextdb.disk import folder_lock, own_files, together

WRITERS: tuple[ModuleType, ...] = (disk, folder_lock, own_files, together)
"""The modules that ask the system to write; `tests/test_failing_disk.py` sees to it that there is no other."""
CALLS = ("open", "write", "fsync", "replace", "rename", "close", "link", "chmod", "mkdir", "ftruncate")
ERRORS = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EINTR)


class FaultyDisk:
    """`os`, whose call number `fails_at` fails; -1: none does."""

    def __init__(self, fails_at: int = -1, error: int = errno.EIO) -> None:
        self.n_calls = 0
        self.failed = ""
        """The call that failed."""
        self._fails_at, self._error = fails_at, error

    def __getattr__(self, name: str) -> Any:
        real = getattr(os, name)
        return self._counted(name, real) if name in CALLS else real

    def _counted(self, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **more: Any) -> Any:
            if name == "open" and not given[1] & (os.O_WRONLY | os.O_RDWR) and not os.path.isdir(given[0]):
                return real(*given, **more)  # a file that is read
            self.n_calls += 1
            if self.n_calls - 1 != self._fails_at:
                return real(*given, **more)
            self.failed = name
            if name == "close":  # closed it is, all the same
                real(*given)
            if name == "write":  # a part of it went through
                real(given[0], given[1][: len(given[1]) // 2])
            raise OSError(self._error, os.strerror(self._error), given[0] if isinstance(given[0], (str, os.PathLike)) else None)

        return call


@contextmanager
def faulty(fails_at: int = -1, error: int = errno.EIO) -> Iterator[FaultyDisk]:
    """Have that call of the writers fail."""
    system = FaultyDisk(fails_at, error)
    with pytest.MonkeyPatch.context() as patch:
        for module in WRITERS:
            patch.setattr(module, "os", system)
        yield system
