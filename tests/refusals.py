"""What pages of tests/transcripts show of errors: their class and their whole text."""

import contextlib
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path


@contextlib.contextmanager
def refusing() -> Iterator[None]:
    """Print the error that ends a block."""
    try:
        yield
    except Exception as error:
        print(f"{type(error).__name__}: {error}")
    else:
        print("not refused")


def refused(call: Callable[[], object]) -> None:
    """Print the error that ends a call."""
    with refusing():
        call()


def folder() -> Path:
    """A new folder beside the others of the page."""
    path = next(path for number in itertools.count(1) if not (path := Path(str(number))).exists())
    path.mkdir()
    return path
