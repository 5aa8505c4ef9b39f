"""A headless Chromium, driven over its debugging protocol: windows with real key events, and what the editor sends them."""

from __future__ import annotations

import asyncio
import base64
import itertools
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import aiohttp

PROGRAM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
DEADLINE_S = 20.0
_CODES = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07]*\x07|.)")
ALT, CTRL, SHIFT = 1, 2, 8
SIGNS = {".": ("Period", 190), "<": ("Comma", 188), " ": ("Space", 32)}
NAMED = {"Enter": 13, "Escape": 27, "Tab": 9, "ArrowDown": 40, "ArrowUp": 38, "ArrowLeft": 37, "ArrowRight": 39, "F6": 117}


@dataclass
class Window:
    """A tab of the browser."""

    browser: Browser
    session: str
    target: str
    received: bytearray = field(default_factory=bytearray)
    """What the terminal in the page was sent since the last `forget`."""
    address: str = ""
    """Of its socket."""

    async def call(self, method: str, **parameters: Any) -> Any:
        return await self.browser.call(method, parameters, self.session)

    async def key(self, key: str, held: int = 0) -> None:
        """Press a key as the keyboard does."""
        name = key if key in NAMED else f"Digit{key}" if key.isdigit() else f"Key{key.upper()}"
        name, code = SIGNS.get(key) or (name, NAMED.get(key) or ord(key.upper()))
        press = {"key": key, "code": name, "windowsVirtualKeyCode": code, "modifiers": held}
        text = {"text": key} if key not in NAMED and held & ~SHIFT == 0 else {}
        if key == "v" and held == CTRL:
            press["commands"] = ["paste"]  # what a browser does by itself, where no window manager sends keys
        await self.call("Input.dispatchKeyEvent", type="keyDown", **press, **text)
        await self.call("Input.dispatchKeyEvent", type="keyUp", **press)

    async def type(self, text: str) -> None:
        for sign in text:
            await self.key(sign)

    async def value(self, script: str) -> Any:
        """What a script of the page gives."""
        answer = await self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
        return answer["result"].get("value")

    @property
    def text(self) -> str:
        """What was painted, without codes."""
        return _CODES.sub("", self.received.decode(errors="replace"))

    def forget(self) -> None:
        self.received.clear()

    async def wait(self, *texts: str) -> str:
        """The text, once it has all of these."""
        await until(lambda: all(text in self.text for text in texts), lambda: f"{texts} not in {self.text[-3000:]!r}")
        return self.text

    async def picture(self, path: Path) -> None:
        path.write_bytes(base64.b64decode((await self.call("Page.captureScreenshot"))["data"]))


@dataclass
class Browser:
    """A Chromium of its own."""

    socket: aiohttp.ClientWebSocketResponse
    windows: dict[str, Window] = field(default_factory=dict)
    _numbers: Any = field(default_factory=itertools.count)
    _answers: dict[int, asyncio.Future[Any]] = field(default_factory=dict)

    async def call(self, method: str, parameters: dict[str, Any], session: str | None = None) -> Any:
        number = next(self._numbers)
        self._answers[number] = asyncio.get_running_loop().create_future()
        message = {"id": number, "method": method, "params": parameters}
        await self.socket.send_json(message if session is None else message | {"sessionId": session})
        return await asyncio.wait_for(self._answers[number], DEADLINE_S)

    async def open(self, address: str, width: int = 1200, height: int = 700) -> Window:
        """A tab with a page."""
        target = (
            await self.call("Target.createTarget", {"url": "about:blank", "newWindow": True, "width": width, "height": height})
        )["targetId"]
        session = (await self.call("Target.attachToTarget", {"targetId": target, "flatten": True}))["sessionId"]
        window = self.windows[session] = Window(self, session, target)
        for domain in ("Page", "Network", "Runtime"):
            await window.call(f"{domain}.enable")
        await window.call("Emulation.setFocusEmulationEnabled", enabled=True)  # no window manager gives the focus
        await window.call("Page.navigate", url=address)
        return window

    async def close(self, window: Window) -> None:
        await self.call("Target.closeTarget", {"targetId": window.target})

    async def listen(self) -> None:
        """Hand on what comes, until the browser ends."""
        async for message in self.socket:
            event = message.json()
            if "id" in event:
                answer = self._answers.pop(event["id"])
                if "error" in event:
                    answer.set_exception(RuntimeError(event["error"]["message"]))
                else:
                    answer.set_result(event["result"])
            elif window := self.windows.get(event.get("sessionId", "")):
                if event["method"] == "Network.webSocketCreated":
                    window.address = event["params"]["url"]
                elif event["method"] == "Network.webSocketFrameReceived":
                    frame = event["params"]["response"]
                    if frame["opcode"] == 2:
                        window.received += base64.b64decode(frame["payloadData"])


async def until(claim: Callable[[], bool], message: Callable[[], str]) -> None:
    """Go on once a claim holds."""
    end = asyncio.get_running_loop().time() + DEADLINE_S
    while not claim():
        assert asyncio.get_running_loop().time() < end, message()
        await asyncio.sleep(0.02)


@asynccontextmanager
async def chromium(folder: Path) -> AsyncIterator[Browser]:
    """A browser with a profile of its own."""
    assert PROGRAM is not None
    profile = folder / "profile"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", f"--user-data-dir={profile}"]
    process = subprocess.Popen([PROGRAM, *options, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        place = profile / "DevToolsActivePort"
        await until(lambda: place.exists() and len(place.read_text().splitlines()) == 2, lambda: "Chromium does not start")
        port, path = place.read_text().splitlines()
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f"ws://127.0.0.1:{port}{path}", max_msg_size=0) as socket,
        ):
            browser = Browser(socket)
            listening = asyncio.create_task(browser.listen())
            yield browser
            listening.cancel()
    finally:
        process.terminate()
        process.wait()


@asynccontextmanager
async def served(folder: Path, environment: dict[str, str], *options: str) -> AsyncIterator[tuple[str, subprocess.Popen[str]]]:
    """`contextdb edit --browser` in a folder; gives the address and the process."""
    command = [sys.executable, "-m", "contextdb", "edit", "t.csv", "--browser", *options]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=pipe, stderr=pipe, encoding="utf-8")
    try:
        assert process.stdout is not None
        line = await asyncio.to_thread(process.stdout.readline)
        yield line.split()[-1] if line else "", process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        await asyncio.to_thread(process.wait, DEADLINE_S)
