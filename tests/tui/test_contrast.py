"""Text can be read on its ground in every theme."""

from pathlib import Path

import pytest
from strategies import IS_FULL, some
from terminal import press, with_editor

from tui.contrast import LEAST, contrast

PLACES = [["alt+2"], ["alt+4"], ["alt+4", "2"], ["alt+5"], ["alt+c"], ["alt+j"], ["f1"], ["ctrl+p"]]
ALL = slice(None)
FRAMES = " │╭╮╰╯─║▏▎▋▌▉▁▂▃▄▅▆▇█▐▊▕▔━┃╸╺" + "".join(map(chr, range(0x2800, 0x2900)))


def faint(app) -> set[tuple[str, str]]:
    """Texts without the contrast, with their theme; of a dialog those in its box, for what is behind it is dimmed on purpose."""
    box = app.screen.query("#dialog, #--container")
    region = box.first().region if box else app.screen.region
    found = set()
    for strip in app.screen._compositor.render_strips()[region.y : region.bottom]:
        for segment in strip.crop(region.x, region.right):
            style = segment.style
            if not segment.text.strip(FRAMES) or style is None or style.color is None or style.bgcolor is None:
                continue
            if style.color.is_default or style.bgcolor.is_default or style.color.number is not None:
                continue
            if contrast(style.color.get_truecolor(), style.bgcolor.get_truecolor()) < LEAST:
                found.add((app.theme, segment.text.strip()))
    return found


async def faint_in_themes(app, pilot, themes: slice = ALL) -> set[tuple[str, str]]:
    found = set()
    for theme in app.theme_names()[themes]:
        app.theme = theme
        await pilot.pause()
        found |= faint(app)
    return found


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed,hit\nwalk,0..2,True\nrun,2..6,Any\njump,Any,False\nbad,5; 9,False\n")
    return file


def test_every_text_of_the_main_screen_has_the_contrast_of_wcag_in_every_theme(path):
    async def script(app, pilot):
        app.main.assets.set_context({"speed": "1"}, "")
        await press(pilot, "down", "right", "shift+down", "shift+right")
        return await faint_in_themes(app, pilot)

    assert with_editor(path, script) == set()


@pytest.mark.parametrize("keys", some(PLACES, 4), ids="-".join)
def test_every_text_of_a_tab_or_a_dialog_has_it_too(path, keys):
    themes = ALL if IS_FULL else slice(PLACES.index(keys) % 3, None, 3)

    async def script(app, pilot):
        await press(pilot, *keys)
        await app.workers.wait_for_complete()
        return await faint_in_themes(app, pilot, themes)

    assert with_editor(path, script, (120, 36) if keys == ["alt+5"] else (80, 24)) == set()


def test_fields_stand_out_from_the_page_where_a_theme_has_one_colour_for_both(path):
    async def script(app, pilot):
        await press(pilot, "alt+2", "tab")
        found = {}
        for theme in ("solarized-light", "solarized-dark"):
            app.theme = theme
            await pilot.pause()
            strips = app.screen._compositor.render_strips()
            field = next(s for strip in strips for s in strip if s.text.strip().startswith("collect"))
            found[theme] = (field.style.bgcolor, app.main.query_one("OptionsPane").rich_style.bgcolor)
        return {theme for theme, (field, page) in found.items() if field == page}

    assert with_editor(path, script) == set()


@pytest.mark.parametrize("theme", ["ansi-dark", "ansi-light"])
def test_selected_cells_have_a_colour_of_text_for_their_ground_in_the_colours_of_the_terminal(path, theme):
    async def script(app, pilot):
        app.theme = theme
        await press(pilot, "down", "right", "shift+down", "shift+right")
        segments = [segment for strip in app.screen._compositor.render_strips() for segment in strip]
        return {
            s.style.color.number for s in segments if s.style and s.style.bgcolor and s.style.bgcolor.number == 4 and s.text.strip()
        }

    assert with_editor(path, script) == {15}


def test_what_lies_behind_the_palette_is_as_dim_as_behind_a_dialog(path):
    async def script(app, pilot):
        feet = []
        for key in ("f1", "ctrl+p"):
            await press(pilot, key)
            feet.append(list(app.screen._compositor.render_strips()[-1].simplify()))
            await press(pilot, "escape")
        return feet

    dialog, palette = with_editor(path, script)
    assert palette == dialog
