"""Write what a terminal sends for keys to a file, until the key "!": python raw_reader.py FILE."""

import os
import sys
import tty
from pathlib import Path


def main(file: str) -> None:
    """Read until then."""
    tty.setraw(0)
    sent = b""
    sys.stdout.write("ready\r\n")
    sys.stdout.flush()
    while not sent.endswith(b"!"):
        sent += os.read(0, 4096)
    Path(file).write_bytes(sent)


if __name__ == "__main__":
    main(sys.argv[1])
