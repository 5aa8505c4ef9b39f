"""Take the pictures of the pages of coverage and of a session in docs/pages/, with any Chromium on the PATH: as wide as a desk or a
phone.

    python docs/pages.py

Browsers and their fonts differ from machine to machine, so that these pictures are looked at and not compared.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from contextdb.motion import write_made_clips

ROOT = Path(__file__).parent.parent
FOLDER = Path(__file__).parent / "pages"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
SIZES = {"coverage-desk.png": (1200, 1100), "coverage-phone.png": (390, 844)}
"""Width and height in pixels."""
MOTION_SIZES = {"motion-coverage-desk.png": (1200, 1150), "motion-coverage-phone.png": (390, 844)}
SESSION_SIZES = {"session-desk.png": (1280, 900), "session-phone.png": (390, 844)}
STICK = """\
time_s,x_mps,z_mps,gait,style
0,0,0,Idle,normal
1,0,1.3,Walk,normal
3,1.3,0,Walk,normal
5,2.6,0,Run,normal
8,0,0,Idle,normal
"""
LEAST_WINDOW_PX = 500
"""Chromium opens no narrower window; a narrower page stands in a frame."""


def write_page(folder: Path) -> Path:
    """The coverage page of the sample tables, as `contextdb coverage` writes it."""
    shutil.copytree(ROOT / "tables", folder / "tables")
    command = [sys.executable, "-m", "contextdb", "coverage", "tables", "--format", "html", "-o", "coverage.html"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "coverage.html"


def write_motion_page(folder: Path) -> Path:
    """The page of motion coverage of the sample clips."""
    write_made_clips(folder / "tables" / "clips")
    command = [sys.executable, "-m", "contextdb", "motion", "coverage", "tables", "--format", "html", "-o", "motion.html"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "motion.html"


def write_session_page(folder: Path) -> Path:
    """The page of a session of the sample clips, in which the player walks, turns and runs."""
    (folder / "stick.csv").write_text(STICK, encoding="utf-8")
    for words in ("run tables player stick.csv --out run.parquet", "replay run.parquet --html session.html"):
        subprocess.run([sys.executable, "-m", "contextdb", "motion", *words.split()], cwd=folder, check=True)
    return folder / "session.html"


def take(browser: str, page: Path, picture: Path, width: int, height: int, at: str = "") -> None:
    """Write what the browser shows of a page, at a moment such as "#t=3.2"."""
    framed = page.with_name("framed.html")
    style = f"display:block;margin:0 auto;border:0;width:{width}px;height:{height}px"
    frame = f'<body style="margin:0;background:#ccc"><iframe src="{page.name}{at}" style="{style}"></iframe>'
    framed.write_text(frame, encoding="utf-8")
    size = f"--window-size={max(width, LEAST_WINDOW_PX)},{height}"
    headless = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=3000", size]
    subprocess.run([*headless, f"--screenshot={picture}", framed.as_uri()], check=True, stderr=subprocess.DEVNULL)


def main() -> int:
    """Take all pictures; 1 without a browser."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        print(f"no browser found; looked for {', '.join(BROWSERS)}", file=sys.stderr)
        return 1
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        page = write_page(Path(folder))
        for name, (width, height) in SIZES.items():
            take(browser, page, FOLDER / name, width, height)
        page = write_motion_page(Path(folder))
        for name, (width, height) in MOTION_SIZES.items():
            take(browser, page, FOLDER / name, width, height)
        page = write_session_page(Path(folder))
        for name, (width, height) in SESSION_SIZES.items():
            take(browser, page, FOLDER / name, width, height, "#t=5.3")
    return 0


if __name__ == "__main__":
    sys.exit(main())
