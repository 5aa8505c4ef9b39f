"""Textual apps in tests, that wait for what is to be done and not for time to pass.

After each key Textual sleeps until the process has used little of the processor for a while: 40 to 80 ms, most of a test's time.
Here a key has done its work once the event loop has nothing left to run, which is sooner, and holds on a busy machine too.

Apps share the rules that Textual reads in their style sheets, which no app changes, and leave nothing behind in Textual's caches.

Every day they also paint only what a test looks at, and make styles and strips with less ado; with EXAMPLES=full they are as
Textual makes them.
"""

import asyncio
import contextlib
import threading
import time
from collections.abc import Iterable, Iterator
from typing import Any
from unittest.mock import patch

from strategies import IS_FULL
from textual._context import active_app
from textual._styles_cache import StylesCache
from textual._wait import wait_for_idle
from textual.app import App
from textual.css.model import RuleSet
from textual.css.styles import Styles
from textual.css.stylesheet import Stylesheet
from textual.dom import DOMNode
from textual.screen import Screen
from textual.strip import Strip

N_UPDATES = 2
"""What is laid out anew may have to be painted anew."""
LONGEST_WAIT_S = 10.0
_read_rules = Stylesheet._parse_rules
_rules: dict[tuple[Any, ...], dict[tuple[Any, ...], list[RuleSet]]] = {}
"""By the variables of a style sheet, and by its source: the rules that stand in it."""
_replace_rules = Stylesheet.replace_rules
_values: dict[tuple[str, Any], Any] = {}
"""What a rule of this name and value becomes in the styles of a part."""
_components: dict[tuple[Any, ...], dict[str, Any]] = {}
"""By style sheet and the place of a part in its app: the rules that hold for each of its components."""
_paint = Screen._compositor_refresh


@contextlib.contextmanager
def quick(paints: bool = IS_FULL, is_light: bool = not IS_FULL) -> Iterator[None]:
    """Apps that are run here wait so. Without `paints` they paint each screen once when it has opened, and at the end; with
    `is_light` their styles and strips are made with less ado."""
    n_threads = threading.active_count()

    async def rested(min_sleep: float = 0.0, max_sleep: float = 1.0) -> None:
        app: Any = active_app.get()
        await _rested(app)
        if paints or getattr(app, "painted_screen", None) is not app.screen:
            await painted(app)
        # A thread that is at work may send the app something later: as long as there is one, Textual's way is the only one.
        if threading.active_count() > n_threads:
            await wait_for_idle(0)

    with (
        patch("textual.app.wait_for_idle", rested),
        patch("textual.pilot.wait_for_idle", rested),
        patch.object(Stylesheet, "_parse_rules", _shared_rules),
        patch.object(RuleSet, "__hash__", object.__hash__),  # by identity as before, without a call of Python for each
        _lighter() if is_light else contextlib.nullcontext(),
    ):
        try:
            yield
        finally:
            # It keeps the last 1024 widgets, and each keeps all lines that it drew: some hundred megabytes.
            StylesCache.get_inner_outer.cache_clear()


def _shared_rules(
    sheet: Any, css: str, read_from: Any, is_default_rules: bool = False, tie_breaker: int = 0, scope: str = ""
) -> Any:
    """What Textual's method of this name gives, worked out once for all apps."""
    variables, rules = vars(sheet).get("shared", (None, {}))
    if variables is not sheet._variables:
        rules = _rules.setdefault(tuple(sheet._variables.items()), {})
        sheet.shared = sheet._variables, rules
    source = css, read_from, is_default_rules, tie_breaker, scope
    if source not in rules:
        rules[source] = _read_rules(sheet, *source)
    return rules[source]


async def _rested(app: App[Any]) -> None:
    """Wait until no part of the app has anything to do, and the screen shows it."""
    end = time.monotonic() + LONGEST_WAIT_S
    await _nothing_ready(end)
    while app._running and getattr(app, "_resize_timer", None) is not None and time.monotonic() < end:
        await asyncio.sleep(0.002)  # a new size counts once it has lasted for some milliseconds
    for _ in range(N_UPDATES):
        await _nothing_ready(end)
        if app._exception is None and app._running and app.screen_stack:
            app.screen._on_timer_update()
    await _nothing_ready(end)


async def painted(app: Any) -> None:
    """Paint what the screen has to show by now."""
    if app._exception is None and app._running and app.screen_stack and app.screen._compositor._dirty_regions:
        _paint(app.screen)
        app.painted_screen = app.screen
        await _nothing_ready(time.monotonic() + LONGEST_WAIT_S)


async def _nothing_ready(end: float) -> None:
    """Give way until the event loop has nothing else to run."""
    loop: Any = asyncio.get_running_loop()
    await asyncio.sleep(0)
    while loop._ready and time.monotonic() < end:
        await asyncio.sleep(0)


# ---- what is made with less ado


@contextlib.contextmanager
def _lighter() -> Iterator[None]:
    with (
        patch.object(Screen, "_compositor_refresh", _paint_later),
        patch.object(Stylesheet, "replace_rules", staticmethod(_first_rules)),
        patch.object(Stylesheet, "_process_component_classes", _shared_components),
        patch.object(Strip, "__init__", _new_strip),
    ):
        yield


def _paint_later(screen: Any) -> None:
    """Leave what is to be painted to the next rest."""
    if screen is screen.app.screen:
        screen._dirty_widgets.clear()
    else:
        _paint(screen)


def _first_rules(node: DOMNode, rules: Any, animate: bool = False) -> None:
    """Give a new part its rules at once, without asking for each what it changes."""
    base = node.styles.base
    if base._rules or animate:
        _replace_rules(node, rules, animate)
        return
    for name, value in rules.items():
        if value is not None:
            base._rules[name] = _value(name, value)  # type: ignore[literal-required]
    base._updates += 1
    if node._is_mounted:
        node.refresh(layout=True)
    node.notify_style_update()


def _value(name: str, value: Any) -> Any:
    if (name, value) not in _values:
        styles = Styles()
        setattr(styles, name, value)
        _values[name, value] = styles._rules.get(name)
    return _values[name, value]


def _shared_components(sheet: Any, node: Any) -> None:
    """What Textual's method of this name does: looked up once for all parts that the same rules of the same sheet fit."""
    names = node._get_component_classes()
    if not names:
        return
    place = tuple((one._css_type_name, one.id, one.classes, one._pseudo_classes_cache_key) for one in node.css_path_nodes)
    known = _components.setdefault((tuple(sheet._variables.items()), tuple(sheet.source), place, node.app.no_color), {})
    before = dict(node._component_styles)
    node._component_styles.clear()
    for name in sorted(names):
        part = DOMNode(classes=name)
        part._attach(node)
        if name in known:
            part.styles.base._rules.update(known[name])
        else:
            sheet.apply(part, animate=False)
            known[name] = dict(part.styles.base._rules)
        node._component_styles[name] = part.styles
    if any(before.get(name) != styles for name, styles in node._component_styles.items()):
        node.refresh()


class _NoCache:
    """Keeps nothing."""

    def get(self, key: object, default: object = None) -> object:
        return default

    def __setitem__(self, key: object, value: object) -> None:
        pass


NO_CACHE: Any = _NoCache()


def _new_strip(strip: Strip, segments: Iterable[Any], cell_length: int | None = None) -> None:
    """A strip without its seven caches: few strips are asked twice before they are painted anew."""
    strip._segments = list(segments)
    strip._cell_length = cell_length
    strip._divide_cache = strip._crop_cache = strip._style_cache = strip._filter_cache = NO_CACHE
    strip._line_length_cache = strip._crop_extend_cache = strip._offsets_cache = NO_CACHE
    strip._render_cache = strip._link_ids = strip._cell_count = None
