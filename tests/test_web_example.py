"""The example in a browser: it plays what Python plays to the bit, and shows what it plays and why, with no request elsewhere."""

import functools
import hashlib
import http.server
import importlib.util
import re
import shutil
import subprocess
import threading
from pathlib import Path

import pytest

import contextdb as cdb
from contextdb import motion
from examples.web import __main__ as web

pytestmark = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="PyPI's ziglang is not installed")
DT, N_TICKS = 1.0 / 60.0, 400
STICKS = ((0.0, 0.0), (0.0, 1.4), (1.4, 0.0), (0.0, 3.2), (-1.0, 1.0), (0.0, 0.0))
PLAY = """
import { readFileSync } from 'node:fs'
import { createHash } from 'node:crypto'
import { opened, steer } from './page.mjs'
const module = await WebAssembly.compile(readFileSync('motion.wasm'))
const bytes = readFileSync('game.motion')
const core = await opened(module, bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength))
const sticks = STICKS, hash = createHash('sha256')
for (let tick = 0; tick < N_TICKS; tick++) {
  const [x, z] = sticks[Math.floor(tick / 60) % sticks.length]
  steer(core, 0, x, z, tick > 250)
  if (core.update(1, tick ? 1 / 60 : 0) !== 1) throw new Error('an update failed')
  hash.update(new Uint8Array(core.memory.buffer, core.state(0), core.state_bytes()))
  hash.update(new Uint8Array(core.memory.buffer, core.rotations(0), 32 * core.n_joints()))
}
const began = performance.now()
for (let tick = 0; tick < 300; tick++) {
  for (let i = 0; i < 20; i++) steer(core, i, Math.sin(i), Math.cos(i + tick / 60), false)
  core.update(20, 1 / 60)
}
console.log(hash.digest('hex'), ((performance.now() - began) / 300).toFixed(3))
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("web")
    web.build(folder)
    return folder


def played_by_python(folder: Path) -> str:
    project = shutil.copytree(web.HERE / "tables", folder / "again")
    (project / "clips").mkdir()
    motion.write_made_clips(project / "clips")
    one, digest = motion.Character.of(cdb.Project.load(project), "player"), hashlib.sha256()
    for tick in range(N_TICKS):
        x, z = STICKS[tick // 60 % len(STICKS)]
        speed = (x * x + z * z) ** 0.5
        facts = {"gait": "Idle" if not speed else "Walk" if speed < 2.1 else "Run", "style": "tired" if tick > 250 else "normal"}
        updated = one.update(DT if tick else 0.0, (x, z), facts)
        digest.update(one.state + updated.pose.rotations.tobytes())
    return digest.hexdigest()


def test_the_module_plays_what_python_plays_to_the_bit(page: Path, tmp_path: Path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node was not found")
    shutil.copyfile(page / "page.js", page / "page.mjs")
    script = PLAY.replace("STICKS", str([list(stick) for stick in STICKS])).replace("N_TICKS", str(N_TICKS))
    (page / "play.mjs").write_text(script, encoding="ascii")
    done = subprocess.run([node, "play.mjs"], cwd=page, capture_output=True, text=True)
    assert done.stderr == ""
    digest, ms_of_20 = done.stdout.split()
    assert digest == played_by_python(tmp_path)
    assert float(ms_of_20) < 16.0


def test_the_module_and_the_page_are_small_and_ask_nobody_else(page: Path):
    assert (page / "motion.wasm").stat().st_size <= 400_000
    assert not re.search(r"https?:|//[a-z]+\.", "".join((page / name).read_text() for name in web.PAGE).replace("// ", ""))


def test_a_browser_shows_a_character_and_why_it_plays(page: Path):
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium was found")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *words: object) -> None:
            asked.append(self.path)

    asked: list[str] = []
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(page)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        line = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=390,844", "--virtual-time-budget=4000"]
        address = f"http://127.0.0.1:{server.server_port}/index.html#walk"
        done = subprocess.run([*line, "--dump-dom", address], capture_output=True, text=True, timeout=120)
    finally:
        server.shutdown()
        server.server_close()
    assert re.search(r'id="say"[^>]*><b>(start_walk|walk)', done.stdout), done.stdout[-2000:]
    assert "gait Walk" in done.stdout
    assert {path.split("#")[0] for path in asked} <= {"/index.html", "/page.js", "/motion.wasm", "/game.motion", "/favicon.ico"}
