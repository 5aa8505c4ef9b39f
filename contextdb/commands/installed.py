"""What is installed with contextdb: the versions that a report of a fault should name."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator
from importlib import metadata

NOT_FOR_USERS = {"dev", "bench", "site"}
"""Extras for those who build contextdb."""
_REQUIRED = re.compile(r"([\w.-]+)(?:\[.*?\])?[^;]*(?:;(.*))?")
_EXTRA = re.compile(r"""extra == ['"]([\w-]+)['"]""")


def lines() -> Iterator[str]:
    """One for Python, one for each package that contextdb uses, and one for each that only an extra brings."""
    packages = dict(_packages())
    versions = {"python": f"{platform.python_version()} on {platform.system()} {platform.machine()}".rstrip()}
    versions |= {name: _version(name, extra) for name, extra in packages.items()}
    width = max(map(len, versions))
    yield from (f"  {name:<{width}}  {version}" for name, version in versions.items())


def _packages() -> Iterator[tuple[str, str]]:
    """The packages and the extra that brings each, "" for those that are always installed."""
    try:
        required = metadata.requires("contextdb") or []
    except metadata.PackageNotFoundError:  # a folder of sources that was not installed
        return
    for line in required:
        match = _REQUIRED.fullmatch(line.strip())
        extra = _EXTRA.search(line)
        if match and not (extra and extra[1] in NOT_FOR_USERS):
            yield match[1].lower(), extra[1] if extra else ""


def _version(name: str, extra: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return f'not installed; pip install "contextdb[{extra}]"' if extra else "not installed"
