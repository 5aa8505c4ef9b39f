"""Take the pictures of the coverage pages in docs/pages/, with any Chromium on the PATH: once as wide as a desk, once as a phone.

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


def take(browser: str, page: Path, picture: Path, width: int, height: int) -> None:
    """Write what the browser shows of a page."""
    framed = page.with_name("framed.html")
    style = f"display:block;margin:0 auto;border:0;width:{width}px;height:{height}px"
    frame = f'<body style="margin:0;background:#ccc"><iframe src="{page.name}" style="{style}"></iframe>'
    framed.write_text(frame, encoding="utf-8")
    size = f"--window-size={max(width, LEAST_WINDOW_PX)},{height}"
    headless = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", size]
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
    return 0


if __name__ == "__main__":
    sys.exit(main())
