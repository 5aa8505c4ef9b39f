"""One editor, and the windows of a browser that show it: a server on this machine.

The editor is a process of its own, started with the size of the first window. That window has its keyboard and gives it its size.
Each further one shows the same screen, and what is typed there goes nowhere; when the first one is closed, the next has the
keyboard. The editor stays while no window is open, and the server ends with the editor.

Everything has an address below a token that nobody can guess. The page loads nothing from elsewhere.

Source: `textual-serve`, whose `AppService` speaks with the process and whose script draws the terminal.
"""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import shlex
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from pathlib import Path

import textual_serve
from aiohttp import WSMsgType, web
from textual_serve.app_service import AppService
from textual_serve.download_manager import DownloadManager

from contextdb.errors import ContextDBError, Fault

PAGE = Path(__file__).with_name("page.html")
STATIC = Path(textual_serve.__file__).parent / "static"
MOST_BYTES = 64 << 20
"""Of one message of a window: a paste."""
WAIT_S = 5.0
"""So long a window may take to receive what is painted; one that takes longer is closed."""
LINGER_S = 60.0
"""So long the editor stays after its last window was closed, where it was started without a terminal."""
LEAST, MOST = (20, 5), (1000, 500)
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; font-src 'self'; "
        "img-src 'self' data:; connect-src 'self' ws: wss:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
}

Send = Callable[[web.WebSocketResponse], Awaitable[None]]


class PortError(ContextDBError):
    """The editor cannot listen at the address."""


class EditorProcess(AppService):
    """The editor, in a process that speaks packets."""

    @property
    def exit_code(self) -> int | None:
        """What the process ended with; None while it runs."""
        return None if self._process is None else self._process.returncode

    async def ended(self) -> int:
        """Wait until the process has ended; gives its exit code."""
        assert self._process is not None
        if self._task is not None:
            await self._task
        return await self._process.wait()


class Desk:
    """An editor and its windows, the one with the keyboard first."""

    def __init__(self, command: Sequence[str], title: str, lingers: bool = True) -> None:
        """`lingers`: the editor stays while no window is open."""
        self._command, self._title, self._lingers = command, title, lingers
        self._token = secrets.token_urlsafe(24)
        self._windows: list[web.WebSocketResponse] = []
        self._size = (80, 24)
        self._downloads = DownloadManager()
        self._editor: EditorProcess | None = None
        self._finished: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._watching: set[asyncio.Task[None]] = set()
        self._linger: asyncio.TimerHandle | None = None

    def app(self) -> web.Application:
        app = web.Application()
        at = f"/{self._token}"
        app.add_routes(
            [
                web.get(f"{at}/", self._page),
                web.get(f"{at}/view", self._view),
                web.get(f"{at}/ws", self._window),
                web.static(f"{at}/static", STATIC),
                web.get("/download/{key}", self._download),
            ]
        )
        return app

    async def serve(self, host: str, port: int, ready: Callable[[str], None]) -> int:
        """Answer until the editor is left; gives its exit code. `ready` is called with the address. Raises PortError where another
        program listens there, or it is no address of this machine."""
        runner = web.AppRunner(self.app(), handle_signals=False, access_log=None)
        await runner.setup()
        try:
            site = web.TCPSite(runner, host, port)
            try:
                await site.start()
            except OSError as error:
                problem = f"the editor cannot listen at {host}:{port}: {os.strerror(error.errno or 0).lower()}."
                raise PortError(Fault(problem, "a free port of this machine", "to leave --port out: a free one is taken")) from None
            port = runner.addresses[0][1]
            ready(f"http://{f'[{host}]' if ':' in host else host}:{port}/{self._token}/")
            with suppress(NotImplementedError):  # Windows
                for one in (signal.SIGINT, signal.SIGTERM):
                    asyncio.get_running_loop().add_signal_handler(one, self._finish, 0)
            return await self._finished
        finally:
            await self._stop()
            await runner.cleanup()

    # ---- the editor

    async def _start(self) -> None:
        self._editor = EditorProcess(
            _joined(self._command),
            write_bytes=self._paint,
            write_str=self._tell_first,
            close=_nothing,
            download_manager=self._downloads,
        )
        await self._editor.start(*self._size)
        task = asyncio.create_task(self._watch(self._editor))
        self._watching.add(task)
        task.add_done_callback(self._watching.discard)

    async def _watch(self, editor: EditorProcess) -> None:
        code = await editor.ended()
        await self._tell_all("closed", "The editor is closed." if code == 0 else f"The editor has ended with exit code {code}.")
        self._finish(code)

    def _finish(self, code: int) -> None:
        if not self._finished.done():
            self._finished.set_result(code)

    async def _stop(self) -> None:
        """Let the editor end, which keeps what is not saved, and close the windows."""
        if self._editor is not None and self._editor.exit_code is None:
            await self._editor.stop()
        for window in list(self._windows):
            with suppress(ConnectionError):
                await window.close()

    async def _paint(self, data: bytes) -> None:
        await self._to_all(lambda window: window.send_bytes(data))

    async def _tell_first(self, text: str) -> None:
        if self._windows:
            await self._to(self._windows[0], lambda window: window.send_str(text))

    async def _tell_all(self, name: str, value: object) -> None:
        await self._to_all(lambda window: window.send_str(json.dumps([name, value])))

    async def _to_all(self, send: Send) -> None:
        await asyncio.gather(*(self._to(window, send) for window in list(self._windows)))

    async def _to(self, window: web.WebSocketResponse, send: Send) -> None:
        try:
            await asyncio.wait_for(send(window), WAIT_S)
        except (ConnectionError, TimeoutError, RuntimeError):
            with suppress(ConnectionError, ValueError):
                self._windows.remove(window)
                await window.close()

    # ---- windows

    async def _page(self, _: web.Request) -> web.FileResponse:
        return web.FileResponse(PAGE, headers=HEADERS)

    async def _view(self, _: web.Request) -> web.Response:
        """What a window that opens now is to show: null, the editor as its first; else its columns and rows."""
        return web.json_response(list(self._size) if self._windows else None, headers=HEADERS)

    async def _window(self, request: web.Request) -> web.WebSocketResponse:
        window = web.WebSocketResponse(heartbeat=15, max_msg_size=MOST_BYTES)
        await window.prepare(request)
        self._windows.append(window)
        if self._linger is not None:
            self._linger.cancel()
        try:
            await self._opened(window, request)
            async for message in window:
                if message.type == WSMsgType.TEXT and self._editor is not None:
                    await self._received(window, message.data)
        finally:
            await self._closed(window)
        return window

    async def _opened(self, window: web.WebSocketResponse, request: web.Request) -> None:
        await window.send_str(json.dumps(["title", self._title]))
        if window is self._windows[0]:
            self._size = _size(request.query.get("width"), request.query.get("height"))
        if self._editor is None:
            await self._start()
            return
        await window.send_bytes(b"\x1b[?1049h\x1b[?25l")
        if window is self._windows[0]:
            await window.send_bytes(b"\x1b[?1000h\x1b[?1003h\x1b[?1006h\x1b[?2004h")
        await self._paint_again()

    async def _closed(self, window: web.WebSocketResponse) -> None:
        was_first = self._windows[:1] == [window]
        with suppress(ValueError):
            self._windows.remove(window)
        if was_first and self._windows:
            await self._to(self._windows[0], lambda one: one.send_str(json.dumps(["view", None])))
        if not self._windows and not self._lingers:
            self._linger = asyncio.get_running_loop().call_later(LINGER_S, self._finish, 0)

    async def _received(self, window: web.WebSocketResponse, text: str) -> None:
        """What a window sends; of those that follow nothing goes on."""
        assert self._editor is not None
        try:
            name, *values = json.loads(text)
            value = values[0] if values else None
        except (ValueError, TypeError):
            return
        if window is not self._windows[0]:
            return
        if name == "stdin" and isinstance(value, str):
            await self._editor.send_bytes(value.encode(errors="replace"))
        elif name == "resize" and isinstance(value, dict):
            self._size = _size(value.get("width"), value.get("height"))
            await self._editor.set_terminal_size(*self._size)
            for one in self._windows[1:]:
                await self._to(one, lambda other: other.send_str(json.dumps(["view", self._size])))
        elif name in ("focus", "blur"):
            await self._editor.send_meta({"type": name})

    async def _paint_again(self) -> None:
        """Have the whole screen painted, for a window that has seen nothing yet."""
        assert self._editor is not None
        width, height = self._size
        await self._editor.set_terminal_size(width, height - 1)
        await self._editor.set_terminal_size(width, height)

    async def _download(self, request: web.Request) -> web.StreamResponse:
        """A file that the editor gives, such as a picture of the screen. Its key is as hard to guess as the token."""
        key = request.match_info["key"]
        try:
            file = await self._downloads.get_download_metadata(key)
        except KeyError:
            raise web.HTTPNotFound from None
        name = "".join(sign if sign.isalnum() or sign in "-_. " else "_" for sign in file.file_name)
        headers = {**HEADERS, "Content-Type": "application/octet-stream", "Content-Disposition": f'attachment; filename="{name}"'}
        response = web.StreamResponse(headers=headers)
        await response.prepare(request)
        async for chunk in self._downloads.download(key):
            await response.write(chunk)
        await response.write_eof()
        return response


def _size(width: object, height: object) -> tuple[int, int]:
    """A size that a window gives, within bounds."""
    columns, rows = (int(str(one)) if str(one).isascii() and str(one).isdigit() else 0 for one in (width, height))
    return min(max(columns, LEAST[0]), MOST[0]), min(max(rows, LEAST[1]), MOST[1])


def _joined(command: Sequence[str]) -> str:
    """A command as the shell of this system reads it."""
    return subprocess.list2cmdline(command) if sys.platform == "win32" else f"exec {shlex.join(command)}"


async def _nothing() -> None:
    """The windows stay until the process has ended."""


def serve(command: Sequence[str], title: str, host: str, port: int, ready: Callable[[str], None]) -> int:
    """Serve an editor, started by a command, until it is left; gives its exit code."""
    os.environ["COLORTERM"] = "truecolor"

    async def run() -> int:
        return await Desk(command, title, lingers=sys.stdout.isatty()).serve(host, port, ready)

    return asyncio.run(run())
