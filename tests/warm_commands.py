"""A program for others to start, git for one, whose commands run in the process of the tests: nothing is loaded anew for each."""

import contextlib
import json
import os
import socketserver
import threading
from collections.abc import Iterator
from unittest.mock import patch

from running import run

PROGRAM = """import json, os, socket, sys
with socket.create_connection(("127.0.0.1", {port})) as link:
    link.sendall(json.dumps([os.getcwd(), dict(os.environ), sys.argv[1:]]).encode() + b"\\n")
    code, out, err = json.loads(link.makefile(encoding="utf-8").read())
sys.stdout.buffer.write(out.encode())
sys.stderr.buffer.write(err.encode())
sys.exit(code)
"""


class _Asked(socketserver.StreamRequestHandler):
    def handle(self) -> None:
        folder, environment, arguments = json.loads(self.rfile.readline())
        with contextlib.chdir(folder), patch.dict(os.environ, environment, clear=True):
            done = run(*arguments)
        self.wfile.write(json.dumps([done.code, done.out, done.err]).encode())


@contextlib.contextmanager
def warm_program() -> Iterator[str]:
    """The text of a Python program that runs its arguments as a command here, where it was started and with its environment.

    One command runs at a time, in a thread, and the folder and the environment of this process are its own meanwhile: whoever
    starts the program waits for it and does nothing else.
    """
    with socketserver.TCPServer(("127.0.0.1", 0), _Asked) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        try:
            yield PROGRAM.format(port=server.server_address[1])
        finally:
            server.shutdown()
            thread.join()
