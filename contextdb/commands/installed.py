"""What is installed beside contextdb: the versions that a report of a fault should name."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator
from importlib import metadata

NOT_FOR_USERS = {"dev", "bench", "site"}
"""Extras for those who build contextdb."""
WITHOUT = {"numba": "not installed; large batches and searches of motion take several times longer"}
_REQUIRED = re.compile(r"([\w.-]+)(?:\[.*?\])?[^;]*(?:;(.*))?")
_EXTRA = re.compile(r"""extra == ['"]([\w-]+)['"]""")


def lines() -> Iterator[str]:
    """One for Python, one for each package that contextdb uses, and one for each that only an extra brings."""
    packages = dict(_packages())
    shown = {"python": f"{platform.python_version()} on {platform.system()} {platform.machine()}".rstrip()}
    shown |= {name: _version(name, extra) for name, extra in packages.items()}
    width = max(map(len, shown))
    yield from (f"  {name:<{width}}  {told}" for name, told in shown.items())


def _packages() -> Iterator[tuple[str, str]]:
    """The packages and the extra that brings each, "" for those that are always installed."""
    try:
        required = metadata.requires("contextdb") or []
    except metadata.PackageNotFoundError:  # a folder of sources that was not installed
        return
    for line in required:
        found = _REQUIRED.fullmatch(line.strip())
        extra = _EXTRA.search(line)
        if found and not (extra and extra[1] in NOT_FOR_USERS):
            yield found[1].lower(), extra[1] if extra else ""


def _version(name: str, extra: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return f'not installed; pip install "contextdb[{extra}]"' if extra else WITHOUT.get(name, "not installed")
