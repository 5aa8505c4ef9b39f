"""Show in a browser what a running game plays: python -m examples.web.live [GAME]

GAME is the name of a link that publishes poses, such as that of `contextdb motion run ... --link game`, or of a game that calls
`link.pose`. Without it, the only one that runs. The page is at http://127.0.0.1:8017, for this machine alone.
"""

from __future__ import annotations

import argparse
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from contextdb.errors import ContextDBError
from contextdb.telemetry.link.hearing import Wanted, hear, the_game

HERE = Path(__file__).parent
FILES = {"/": ("live.html", "text/html"), "/live.js": ("live.js", "text/javascript")}


class Page(BaseHTTPRequestHandler):
    """Serves the page, and the lines of a game as they come."""

    game: str | None = None

    def do_GET(self) -> None:
        """Answer this machine's own browser: a page elsewhere that leads here under another name gets nothing."""
        address: Any = self.server.server_address
        host, port = address[:2]
        if self.headers.get("Host") not in (f"{host}:{port}", f"localhost:{port}"):
            self.send_error(403)
        elif self.path == "/lines":
            self._lines()
        elif self.path in FILES:
            name, kind = FILES[self.path]
            self._begin(f"{kind}; charset=utf-8")
            self.wfile.write((HERE / name).read_bytes())
        else:
            self.send_error(404)

    def _lines(self) -> None:
        try:
            with hear(the_game(self.game)[1], Wanted(poses=True)) as hearing:
                self._begin("text/event-stream")
                for batch in hearing.batches():
                    wanted = [raw for raw, line in batch if line["line"] in ("bones", "pose")]
                    self.wfile.write(b"".join(b"data: " + raw + b"\n" for raw in wanted))
        except (ContextDBError, OSError):  # nobody plays, or nobody looks any more: the page comes again
            self.close_connection = True

    def _begin(self, kind: str) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.end_headers()

    def log_message(self, *words: object) -> None:
        """Print nothing for each request."""


def server(game: str | None, port: int) -> ThreadingHTTPServer:
    """The server of the page, on this machine alone."""
    served = ThreadingHTTPServer(("127.0.0.1", port), type("Page", (Page,), {"game": game}))
    served.daemon_threads = True
    return served


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m examples.web.live", description=__doc__.splitlines()[0])
    parser.add_argument("game", nargs="?")
    parser.add_argument("--port", type=int, default=8017)
    given = parser.parse_args()
    with server(given.game, given.port) as page:
        print(f"http://127.0.0.1:{page.server_port}")
        try:
            page.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
