"""A change that somebody makes in a file while a picture is being taken."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Slip:
    """A mistake, or another's change, made between two steps: `old`, which stands in the file once, becomes `new`."""

    file: str
    old: str
    new: str


def make(slip: Slip, folder: Path) -> None:
    """Change the file; ValueError where what is to be changed is not in it just once."""
    path = folder / slip.file
    text = path.read_bytes().decode()
    if text.count(slip.old) != 1:
        raise ValueError(f"{slip.old!r} stands {text.count(slip.old)} times in {slip.file}, not once")
    path.write_bytes(text.replace(slip.old, slip.new).encode())
