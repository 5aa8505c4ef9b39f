"""Text can be read on its ground in every theme."""

from __future__ import annotations

from pathlib import Path

from terminal import press, with_editor

from tui.contrast import LEAST, contrast

FRAMES = " │╭╮╰╯─║▏▎▋▌▉▁▂▃▄▅▆▇█"


def test_every_text_of_the_main_screen_has_the_contrast_of_wcag_in_every_theme(tmp_path: Path):
    path = tmp_path / "t.csv"
    path.write_text("Asset,speed,hit\nwalk,0..2,True\nrun,2..6,Any\njump,Any,False\nbad,5; 9,False\n")

    def faint(app) -> set[tuple[str, str]]:
        found = set()
        for segment in (segment for strip in app.screen._compositor.render_strips() for segment in strip):
            style = segment.style
            if not segment.text.strip(FRAMES) or style is None or style.color is None or style.bgcolor is None:
                continue
            if style.color.is_default or style.bgcolor.is_default or style.color.number is not None:
                continue
            if contrast(style.color.get_truecolor(), style.bgcolor.get_truecolor()) < LEAST:
                found.add((app.theme, segment.text.strip()))
        return found

    async def script(app, pilot):
        app.main.assets.set_context({"speed": "1"}, "")
        await press(pilot, "down", "right", "shift+down", "shift+right")
        found = set()
        for theme in app.theme_names():
            app.theme = theme
            await pilot.pause()
            found |= faint(app)
        return found

    assert with_editor(path, script) == set()
