"""The editor in a real browser: keys, pastes, colours and sizes arrive as in a terminal, and one window has the keyboard."""

import asyncio
import os
import re
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from strategies import in_full_runs
from warm_start import python

pytest.importorskip("textual_serve")  # of the extra `browser`
import aiohttp
from chromium import ALT, CTRL, PROGRAM, Browser, chromium, served

ROOT = Path(__file__).parent.parent.parent
RAW = b"Asset,speed,hit\r\n" + b"".join(b"clip_%02d,%d,True\r\n" % (i, i) for i in range(40))


needs_browser = pytest.mark.skipif(PROGRAM is None, reason="Chromium is not installed")
Script = Callable[[Browser, str, "subprocess.Popen[str]"], Awaitable[None]]


def environment(folder: Path) -> dict[str, str]:
    settings = {"PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    kept = {name: text for name, text in os.environ.items() if name not in ("COLORTERM", "NO_COLOR", "DISPLAY", "WAYLAND_DISPLAY")}
    return {**kept, **settings, "BROWSER": "true", "TERM": "dumb"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "t.csv").write_bytes(RAW)
    return tmp_path


def in_browser(folder: Path, script: Script, *options: str) -> None:
    async def run() -> None:
        async with served(folder, environment(folder), *options) as (address, process), chromium(folder) as browser:
            await script(browser, address, process)

    asyncio.run(run())


@needs_browser
def test_keys_pastes_and_colours_arrive_as_in_a_terminal(folder: Path) -> None:
    async def script(browser: Browser, address: str, process: subprocess.Popen[str]) -> None:
        window = await browser.open(address, 1400, 800)
        await browser.call("Browser.grantPermissions", {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]})
        await window.wait("clip_00", "F2 Edit")
        width, height = map(int, re.findall(r"=(\d+)", window.address))
        painted = window.received.decode()
        assert width > 120
        assert height > 30
        assert {len(line) for line in window.text.split("\n") if "clip_0" in line} == {width}  # the first paint fills the window
        assert "38;2;" in painted
        assert "48;2;" in painted
        assert "38;5;" not in painted

        await window.key("ArrowDown")
        await window.type("quick")
        await window.key("Enter")
        window.forget()
        await window.key("4", ALT)
        await window.wait("Contexts without a valid row")
        await window.key("1", ALT)
        await window.wait("clip_02")
        await window.key("c", CTRL)
        await window.wait("Copied")
        assert await window.value("navigator.clipboard.readText()") == "clip_02\n"
        await window.value("navigator.clipboard.writeText('from outside')")
        await window.key("v", CTRL)
        await window.wait("from outside")
        await window.key("s", CTRL)
        await window.wait("Saved t.csv")
        assert (folder / "t.csv").read_bytes().splitlines()[1:4] == [b"clip_00,0,True", b"quick,1,True", b"from outside,2,True"]
        await window.key("q", CTRL)
        assert await asyncio.to_thread(process.wait, 30) == 0

    in_browser(folder, script)


@needs_browser
@pytest.mark.parametrize("width", [390, 760])
def test_a_narrow_window_in_light_colours_imports_and_builds_a_rule_by_keys(folder: Path, width: int) -> None:
    rows = b"Asset,rule,speed\nclip_00,,0..2\n"
    (folder / "t.csv").write_bytes(rows)
    (folder / "contextdb.toml").write_text(
        '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 9\n[tables.t]\nwhen = "rule"\n', encoding="utf-8"
    )
    (folder / "t.cases.csv").write_text("Case,Expected,speed\nslow,clip_00,0.5\n", encoding="utf-8")
    (folder / "week.csv").write_text("Asset,rule,speed\nclip_01,,0.5\nclip_02,,1.5\n", encoding="utf-8")

    async def script(browser: Browser, address: str, process: subprocess.Popen[str]) -> None:
        window = await browser.open(address, width, 700)
        await window.call("Emulation.setDeviceMetricsOverride", width=width, height=700, deviceScaleFactor=1, mobile=False)
        await window.wait("clip_00", "F2 Edit")

        async def shows(*keys: tuple[str, int], then: str) -> None:
            window.forget()
            for key, held in keys:
                await window.key(key, held)
            await window.wait(then)

        await shows(("6", ALT), then=" Contracts ")  # its tab, too, where there is no room for all
        await window.wait("proved for every", "Such as: Whenever")
        ground = "getComputedStyle(document.querySelector('.xterm-viewport')).backgroundColor"
        assert await window.value(ground) == "rgb(232, 236, 241)"  # of the edges of the window
        assert await window.value("document.documentElement.scrollWidth <= innerWidth")
        await shows(("1", ALT), *((key, 0) for key in ("ArrowRight", *"spe")), then="speed")
        await shows(("Enter", 0), *((key, 0) for key in " < 1"), then="true now")
        await shows(("Enter", 0), ("s", CTRL), then="Saved")
        await shows(("p", CTRL), *((key, 0) for key in "import"), then="Read rows")
        await shows(("Enter", 0), then="Import into t")
        await shows(*((key, 0) for key in "week.csv"), ("Enter", 0), then="2 rows in the file")
        await shows(("F6", 0), then="Import week.csv.")
        await shows(("s", CTRL), then="Saved")

    in_browser(folder, script, "--theme", "contextdb-light")
    assert (folder / "t.csv").read_text().splitlines() == [
        "Asset,rule,speed", "clip_00,speed < 1,0..2", "clip_01,,0.5", "clip_02,,1.5",
    ]  # fmt: skip


@in_full_runs
@needs_browser
def test_a_second_window_follows_the_first_and_has_the_keyboard_when_that_is_closed(folder: Path) -> None:
    async def script(browser: Browser, address: str, process: subprocess.Popen[str]) -> None:
        first = await browser.open(address)
        await first.wait("clip_00", "F2 Edit")
        second = await browser.open(address, 700, 400)
        await second.wait("clip_00", "F2 Edit")
        assert "follows" in await second.value("document.getElementById('line').textContent")
        await second.type("lost")
        await first.type("kept")
        await second.wait("kept")
        await first.key("Enter")
        await first.key("s", CTRL)
        await second.wait("Saved t.csv")
        assert (folder / "t.csv").read_bytes().splitlines()[1] == b"kept,0,True"
        await browser.close(first)
        while not await second.value("follows === null && painted"):  # it begins again, as the window with the keyboard
            await asyncio.sleep(0.02)
        second.forget()
        await second.type("next")
        await second.wait("next")
        await second.key("Enter")
        second.forget()
        await second.key("s", CTRL)
        await second.wait("Saved t.csv")
        assert (folder / "t.csv").read_bytes().splitlines()[2] == b"next,1,True"

    in_browser(folder, script)


@in_full_runs
@needs_browser
def test_with_read_only_nothing_is_edited_or_written(folder: Path) -> None:
    before = {path.name for path in folder.iterdir()}

    async def script(browser: Browser, address: str, process: subprocess.Popen[str]) -> None:
        window = await browser.open(address)
        await window.wait("clip_00", "This table is read-only", "F2 Edit")
        await window.type("lost")
        await window.key("Enter")
        await window.wait("Nothing is edited")
        await window.key("s", CTRL)
        await window.wait("nothing is written")

    in_browser(folder, script, "--read-only")
    assert (folder / "t.csv").read_bytes() == RAW
    assert {path.name for path in folder.iterdir()} - before == {"profile"}


@in_full_runs
def test_unsaved_edits_are_there_again_after_the_server_is_interrupted(folder: Path) -> None:
    async def edit() -> None:
        async with window(folder) as socket:
            await painted_until(socket, "clip_00")
            await socket.send_json(["focus"])
            await socket.send_json(["stdin", "typed here\r"])
            await painted_until(socket, "t *")

    async def again() -> None:
        async with window(folder) as socket:
            await painted_until(socket, "1 unsaved edit restored")

    asyncio.run(edit())
    assert (folder / "t.csv").read_bytes() == RAW
    asyncio.run(again())


@asynccontextmanager
async def window(folder: Path) -> AsyncIterator[Any]:
    """A window without a browser."""
    async with (
        served(folder, environment(folder)) as (address, _),
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{address}ws?width=100&height=30") as socket,
    ):
        yield socket


async def painted_until(socket: Any, text: str) -> str:
    painted = ""

    async def read() -> None:
        nonlocal painted
        while text not in painted:
            message = await socket.receive()
            assert message.type in (aiohttp.WSMsgType.BINARY, aiohttp.WSMsgType.TEXT), f"{text} not in {painted!r}"
            if message.type == aiohttp.WSMsgType.BINARY:
                painted += re.sub(r"\x1b\[[0-?]*[ -/]*[@-~]", "", message.data.decode(errors="replace"))

    await asyncio.wait_for(read(), 60)
    return painted


def test_nothing_answers_without_the_token_and_the_page_loads_nothing_from_elsewhere(folder: Path) -> None:
    async def run() -> None:
        async with served(folder, environment(folder)) as (address, _), aiohttp.ClientSession() as session:
            assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address)
            for path in ("", "ws", "view", "static/js/textual.js", "x" * 32 + "/", "x" * 32 + "/ws"):
                async with session.get("/".join(address.split("/")[:3]) + f"/{path}") as answer:
                    assert answer.status == 404
            async with session.get(address) as answer:
                assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
                assert answer.headers["Referrer-Policy"] == "no-referrer"
                assert not re.findall(r"(?:src|href)=\"(?!static/)|https?://", await answer.text())

    asyncio.run(run())


def test_what_a_window_sends_that_is_no_message_changes_nothing(folder: Path) -> None:
    async def run() -> None:
        async with window(folder) as socket:
            await painted_until(socket, "F1")
            for text in ("", "[", "{}", "[]", "7", '["stdin", 7]', '["resize", {"width": "NaN"}]', '["resize", 3]', '["quit"]'):
                await socket.send_str(text)
            await socket.send_str('["focus"]')
            await socket.send_str('["resize", {"width": 90, "height": 24}]')
            await painted_until(socket, "F2 Edit")

    asyncio.run(run())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--browser", "--port", "70000"], "is not a port"),
        (["--port", "80"], "--browser with them"),
        (["--browser", "--theme", "contextdb-drak"], "contextdb-dark"),
        (["--browser", "--host", "192.0.2.1"], "cannot listen at 192.0.2.1"),
    ],
)
def test_what_cannot_be_served_is_one_message(folder: Path, options: list[str], message: str) -> None:
    command = python("-m", "contextdb", "edit", "t.csv", *options)
    done = subprocess.run(
        command, cwd=folder, env=environment(folder), capture_output=True, encoding="utf-8", timeout=120, check=False
    )
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_a_port_that_is_taken_is_one_message(folder: Path) -> None:
    async def run() -> None:
        async with served(folder, environment(folder)) as (address, _):
            port = address.split("/")[2].partition(":")[2]
            async with served(folder, environment(folder), "--port", port) as (other, process):
                assert other == ""
                assert await asyncio.to_thread(process.wait, 60) == 2
                assert process.stderr is not None
                assert "to leave --port out" in process.stderr.read()

    asyncio.run(run())


def test_without_the_extra_the_message_says_how_to_install_it(folder: Path) -> None:
    hide = "import sys; sys.modules['textual_serve'] = None; from contextdb.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", hide, "edit", "t.csv", "--browser"]
    done = subprocess.run(
        command, cwd=folder, env=environment(folder), capture_output=True, encoding="utf-8", timeout=120, check=False
    )
    assert done.returncode == 2
    assert 'pip install "contextdb[browser]"' in done.stderr


def test_no_port_listens_before_the_table_can_be_read(folder: Path) -> None:
    (folder / "t.csv").unlink()
    (folder / "contextdb.toml").write_text("[", encoding="utf-8")
    done = subprocess.run(
        python("-m", "contextdb", "edit", "t.csv", "--browser"),
        cwd=folder, env=environment(folder), capture_output=True, encoding="utf-8", timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert "contextdb.toml, line 1" in done.stderr
