"""The timeline: what plays, when it was searched and jumped, and measures as strips, about the moment that is seen.

A column of the screen shows a stretch of time. The window is part of the session, or all of it; the line `session` is always
all of it: how often it jumps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from contextdb.console import printable
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints

from ..widgets.fitted import fitted
from .recording import Recording

LABEL = 9
N_COLOURS = 8
BARS = " ▁▂▃▄▅▆▇█"
WINDOWS_S = (2.0, 5.0, 10.0, 20.0, 60.0, 300.0)
LEAST_NAME = 5
TITLES = {
    "cost": "cost",
    "valid": "valid",
    "accel": "accel",
    "skate": "skate",
    "error": "path err",
}
"""The strips, by the name of what is measured."""
LEAST = {"accel": 1.0, "skate": 1.0, "error": 0.01}
"""A strip is as high as so much at least: what is less is noise, and is not drawn large."""
UNITS = {"cost": "", "valid": "assets", "accel": "m/s²", "skate": "cm/s", "error": "m"}


class Timeline(Widget):
    """What plays, over time."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {
        *(f"timeline--asset-{i}" for i in range(N_COLOURS)),
        "timeline--label",
        "timeline--here",
        "timeline--strip",
        "timeline--chosen",
        "timeline--forced",
        "timeline--jump",
        "timeline--search",
        "timeline--cursor",
    }
    DEFAULT_CSS = """
    Timeline {
        height: auto; background: $surface;
        & .timeline--label { color: $text-muted; }
        & .timeline--here { color: $foreground; text-style: bold; }
        & .timeline--strip { color: $primary 70%; }
        & .timeline--chosen { color: $accent; }
        & .timeline--forced { color: $error; text-style: bold; }
        & .timeline--jump { color: $warning; text-style: bold; }
        & .timeline--search { color: $text-muted; }
        & .timeline--cursor { background: $foreground; color: $background; }
        & .timeline--asset-0 { background: #31506e; color: #e6edf5; }
        & .timeline--asset-1 { background: #3c5f45; color: #e6f5ea; }
        & .timeline--asset-2 { background: #6a5330; color: #f5eee0; }
        & .timeline--asset-3 { background: #5b4370; color: #f0e6f7; }
        & .timeline--asset-4 { background: #2f6066; color: #e2f3f5; }
        & .timeline--asset-5 { background: #6b4047; color: #f7e6e9; }
        & .timeline--asset-6 { background: #555b34; color: #f1f3e0; }
        & .timeline--asset-7 { background: #434a66; color: #e6e9f5; }
    }
    """

    @dataclass
    class Scrubbed(Message):
        """The mouse is at another moment."""

        index: int

    def __init__(self, recording: Recording) -> None:
        super().__init__(id="timeline")
        self.recording = recording
        self.index = 0
        self.strips: dict[str, Floats] = {"cost": recording.line.costs, "valid": recording.line.n_valid}
        self.measure = "cost"
        self.n_strips = 2
        self.window_s: float | None = None if recording.line.seconds <= WINDOWS_S[3] else WINDOWS_S[2]
        self._is_dragging = False

    # ---- what is seen

    def go(self, index: int) -> None:
        self.index = index
        self.refresh()

    def grow(self) -> None:
        """The session is another than it was."""
        self.strips = {"cost": self.recording.line.costs, "valid": self.recording.line.n_valid}
        self.refresh()

    def add_strips(self, strips: Mapping[str, Floats]) -> None:
        self.strips.update({name: strips[name] for name in TITLES if name in strips})
        self.refresh(layout=True)

    def next_measure(self) -> str:
        """Choose the next measure that there is."""
        names = [name for name in TITLES if name in self.strips]
        self.measure = names[(names.index(self.measure) + 1) % len(names)]
        self.refresh()
        return self.measure

    def zoom(self, nearer: bool) -> None:
        """Show a shorter window, or a longer one."""
        steps: list[float | None] = [*(s for s in WINDOWS_S if s < self.recording.line.seconds), None]
        at = steps.index(self.window_s) if self.window_s in steps else len(steps) - 1
        self.window_s = steps[min(max(at + (-1 if nearer else 1), 0), len(steps) - 1)]
        self.refresh()

    def peak_from(self, index: int, forwards: bool) -> int | None:
        """Where the chosen measure has its next peak: a local maximum of its highest tenth."""
        values = np.nan_to_num(self.strips[self.measure], nan=-np.inf)
        finite = values[np.isfinite(values)]
        if not len(finite):
            return None
        bar = np.quantile(finite, 0.9)
        rises = values > np.append(-np.inf, values[:-1])
        holds = values >= np.append(values[1:], -np.inf)
        peaks = np.flatnonzero(rises & holds & (values >= bar))
        ahead = peaks[peaks > index] if forwards else peaks[peaks < index][::-1]
        return int(ahead[0]) if len(ahead) else None

    @property
    def visible_strips(self) -> list[str]:
        """The strips that are seen: the chosen one first where not all fit."""
        names = [name for name in TITLES if name in self.strips]
        if len(names) <= self.n_strips:
            return names
        strips = [self.measure, *(name for name in names if name != self.measure)][: self.n_strips]
        return [name for name in names if name in strips]

    def get_content_height(self, container: object, viewport: object, width: int) -> int:
        """Session, ruler, what plays, what happened, and the strips."""
        return 4 + len(self.visible_strips)

    # ---- columns

    @property
    def _n_columns(self) -> int:
        return max(1, self.size.width - LABEL - 1)

    def _window(self) -> tuple[int, int]:
        """The first update that is seen, and the one behind the last."""
        n, line = len(self.recording), self.recording.line
        if self.window_s is None:
            return 0, n
        half = max(1, round(0.5 * self.window_s * line.rate))
        first = min(max(0, self.index - half), max(0, n - 2 * half))
        return first, min(n, first + 2 * half)

    def _edges(self, first: int, stop: int) -> Ints:
        """The first update of each column, and the end of the last."""
        return first + np.arange(self._n_columns + 1) * (stop - first) // self._n_columns

    def _column(self, edges: Ints) -> int:
        return int(np.clip(np.searchsorted(edges, self.index, side="right") - 1, 0, self._n_columns - 1))

    # ---- painting

    def render_line(self, y: int) -> Strip:
        first, stop = self._window()
        edges = self._edges(0, len(self.recording)) if y == 0 else self._edges(first, stop)
        names = self.visible_strips
        if y == 0:
            label, cells = self._session(edges)
        elif y == 1:
            label, cells = self._ruler(edges)
        elif y == 2:
            label, cells = self._assets(edges)
        elif y == 3:
            label, cells = self._events(edges)
        elif y - 4 < len(names):
            label, cells = self._strip(names[y - 4], edges)
        else:
            return Strip.blank(self.size.width, self.rich_style)
        at = self._column(edges)
        text, style = cells[at]
        cursor = self.get_component_rich_style("timeline--cursor")
        cells[at] = ("▼" if y == 1 else text, cursor if y in (0, 2, 3) else style + cursor)
        joined = [Segment(label[0], label[1]), *_merged_segments(cells)]
        return Strip(joined).adjust_cell_length(self.size.width, self.rich_style)

    def _label(self, text: str, is_here: bool = False) -> tuple[str, Style]:
        style = self.get_component_rich_style("timeline--here" if is_here else "timeline--label")
        return fitted(text, LABEL) + " ", style

    def _session(self, edges: Ints) -> tuple[tuple[str, Style], list[tuple[str, Style]]]:
        counts = np.add.reduceat(self.recording.line.jumped.astype(np.float64), np.minimum(edges[:-1], len(self.recording) - 1))
        counts[np.diff(edges) == 0] = 0.0
        smooth = np.convolve(counts, np.ones(3) / 3.0, "same") if len(counts) > 2 else counts
        style = self.get_component_rich_style("timeline--search")
        levels = _levels(smooth, 0.0, float(smooth.max(initial=0.0)) or 1.0)
        return self._label(" jumps/s"), [(BARS[level], style) for level in levels]

    def _ruler(self, edges: Ints) -> tuple[tuple[str, Style], list[tuple[str, Style]]]:
        line, style = self.recording.line, self.get_component_rich_style("timeline--label")
        cells = [(" ", style)] * self._n_columns
        times = line.times_s[np.minimum(edges, len(line) - 1)]
        step = _round_step(float(times[-1] - times[0]), max(1, self._n_columns // 9))
        at_s = np.ceil(times[0] / step) * step
        while at_s <= times[-1] + 1e-9:
            column = int(np.clip(np.searchsorted(times, at_s, side="right") - 1, 0, self._n_columns - 1))
            text = f"{at_s:g}s"
            if column + len(text) <= self._n_columns:
                cells[column : column + len(text)] = [(letter, style) for letter in text]
            at_s += step
        return self._label(" time"), cells

    def _assets(self, edges: Ints) -> tuple[tuple[str, Style], list[tuple[str, Style]]]:
        line = self.recording.line
        plays = line.playing[np.minimum(edges[:-1], len(line) - 1)]
        sides = line.mirrored[np.minimum(edges[:-1], len(line) - 1)]
        blank = self.rich_style
        styles = [self.get_component_rich_style(f"timeline--asset-{i}") for i in range(N_COLOURS)]
        cells: list[tuple[str, Style]] = []
        bounds = np.flatnonzero((np.diff(plays, prepend=-2) != 0) | (np.diff(sides.astype(np.int8), prepend=-2) != 0)).tolist()
        for start, stop in zip(bounds, [*bounds[1:], len(plays)], strict=True):
            asset, width = int(plays[start]), stop - start
            name = "" if asset < 0 else printable(line.assets[asset]) + (" ~" if sides[start] else "")
            text = _tail(name, width - 1) if width >= LEAST_NAME else ""
            style = blank if asset < 0 else styles[asset % N_COLOURS]
            cells += [(letter, style) for letter in f"▏{text}".ljust(width)[:width]]
        return self._label(" plays"), cells

    def _events(self, edges: Ints) -> tuple[tuple[str, Style], list[tuple[str, Style]]]:
        line = self.recording.line
        cells: list[tuple[str, Style]] = []
        kinds = (
            (line.forced, "!", "timeline--forced"),
            (line.jumped, "│", "timeline--jump"),
            (line.new_facts, "+", "timeline--search"),
            (line.searched, "·", "timeline--search"),
        )
        styles = {name: self.get_component_rich_style(name) for _, _, name in kinds}
        counts = [np.concatenate(([0], np.cumsum(flags))) for flags, _, _ in kinds]
        for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            end = max(stop, start + 1) if stop > start else start
            kind = next((i for i, levels in enumerate(counts) if levels[min(end, len(line))] > levels[start]), None)
            cells.append((" ", self.rich_style) if kind is None else (kinds[kind][1], styles[kinds[kind][2]]))
        return self._label(" events"), cells

    def _strip(self, name: str, edges: Ints) -> tuple[tuple[str, Style], list[tuple[str, Style]]]:
        values = np.nan_to_num(self.strips[name], nan=0.0)
        first, stop = int(edges[0]), int(edges[-1])
        starts = np.minimum(edges[:-1], stop - 1)
        peaks = np.maximum.reduceat(values[:stop], starts) if stop > first else np.zeros(self._n_columns)
        top = float(np.quantile(values, 0.995)) if len(values) else 0.0
        is_chosen = name == self.measure
        style = self.get_component_rich_style("timeline--chosen" if is_chosen else "timeline--strip")
        cells = [(BARS[level], style) for level in _levels(peaks, 0.0, max(top, LEAST.get(name, 0.0)) or 1.0)]
        return self._label(f"{'▸' if is_chosen else ' '}{TITLES[name]}", is_chosen), cells

    # ---- mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Go to the moment under the mouse."""
        self._is_dragging = True
        self.capture_mouse()
        self._scrub(event.x, event.y)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Go with the mouse while it is held."""
        if self._is_dragging:
            self._scrub(event.x, 1)

    def on_mouse_up(self) -> None:
        self._is_dragging = False
        self.release_mouse()

    def on_mouse_scroll_up(self) -> None:
        self.zoom(True)

    def on_mouse_scroll_down(self) -> None:
        self.zoom(False)

    def _scrub(self, x: int, y: int) -> None:
        column = min(max(0, x - LABEL - 1), self._n_columns - 1)
        edges = self._edges(0, len(self.recording)) if y == 0 else self._edges(*self._window())
        self.post_message(self.Scrubbed(min(int(edges[column]), len(self.recording) - 1)))


def _levels(values: Floats, least: float, most: float) -> list[int]:
    """Values as heights of bars, 0 to 8; only what is not above the least is 0."""
    shares = np.clip((values - least) / max(most - least, 1e-12), 0.0, 1.0)
    return [0 if share <= 0.0 else max(1, round(8.0 * share)) for share in shares.tolist()]


def _merged_segments(cells: list[tuple[str, Style]]) -> list[Segment]:
    """Cells as segments, those of one style together."""
    segments: list[Segment] = []
    start = 0
    for i in range(1, len(cells) + 1):
        if i == len(cells) or cells[i][1] is not cells[start][1]:
            segments.append(Segment("".join(text for text, _ in cells[start:i]), cells[start][1]))
            start = i
    return segments


def _tail(name: str, width: int) -> str:
    """A name in a width: its end says more than its beginning."""
    return name if len(name) <= width else "…" + name[len(name) - width + 1 :]


def _round_step(seconds: float, n: int) -> float:
    """A round number of seconds, so that about n of them are in a stretch."""
    wanted = max(seconds, 1e-3) / n
    scale = 10.0 ** np.floor(np.log10(wanted))
    return float(next(scale * step for step in (1.0, 2.0, 5.0, 10.0) if scale * step >= wanted - 1e-12))
