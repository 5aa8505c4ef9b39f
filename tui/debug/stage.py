"""The stage: skeletons and paths about the body, as braille, from a side that one chooses."""

from __future__ import annotations

import itertools
import math
from typing import ClassVar

import numpy as np
from rich.segment import Segment
from textual import events
from textual.binding import Binding, BindingType
from textual.strip import Strip
from textual.widget import Widget

from contextdb.motion.clips.quaternions import Floats

from ..widgets.fitted import fitted
from .camera import Camera
from .canvas import HIGH, WIDE, Canvas
from .figures import Figure, grid

GROUND, CANDIDATES, GOT, ASSET, PLAYS_ON, WANTED, CHOSEN = range(1, 8)
NAMES = ("blank", "ground", "candidates", "got", "asset", "plays-on", "wanted", "chosen")
LEGEND = (
    (CHOSEN, "plays"),
    (PLAYS_ON, "would play on"),
    (ASSET, "asset at cursor"),
    (WANTED, "wanted path"),
    (GOT, "got path"),
    (CANDIDATES, "candidates"),
)
TURN = math.radians(15.0)
DRAG = math.radians(4.0)
NEARER = 1.25


class Stage(Widget, can_focus=True):
    """Skeletons and paths."""

    ALLOW_SELECT = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "tilt(1)", "From above", show=False),
        Binding("down", "tilt(-1)", "From below", show=False),
    ]
    COMPONENT_CLASSES: ClassVar[set[str]] = {f"stage--{name}" for name in NAMES}
    DEFAULT_CSS = """
    Stage {
        background: $background;
        & .stage--blank { color: $foreground; }
        & .stage--ground { color: $foreground 22%; }
        & .stage--candidates { color: #8a6fb0; }
        & .stage--got { color: $foreground 55%; }
        & .stage--asset { color: $warning; }
        & .stage--plays-on { color: $foreground 60%; }
        & .stage--wanted { color: $primary; }
        & .stage--chosen { color: $success; }
    }
    """

    def __init__(self) -> None:
        super().__init__(id="stage")
        self.camera = Camera()
        self.figure: Figure | None = None
        self.note = ""
        """Stands on the stage where there is no pose."""
        self._cells: tuple[list[str], object] | None = None
        self._drag: tuple[int, int] | None = None

    def show(self, figure: Figure | None, note: str = "") -> None:
        self.figure, self.note = figure, note
        self._changed()

    def look(self, camera: Camera) -> None:
        """Look from somewhere else."""
        self.camera = camera
        self._changed()

    def _changed(self) -> None:
        self._cells = None
        self.refresh()

    def on_resize(self) -> None:
        self._changed()

    def action_tilt(self, up: int) -> None:
        """From higher, or lower."""
        self.look(self.camera.turned(0.0, up * TURN))

    # ---- painting

    def draw(self, width: int, height: int) -> Canvas:
        """The figure on a canvas of so many cells."""
        canvas, it = Canvas(width, height), self.figure
        if it is None:
            return canvas
        starts, stops = grid(it.place)
        canvas.lines(self._dots(starts, canvas), self._dots(stops, canvas), GROUND)
        for path in it.candidates:
            canvas.path(self._dots(path, canvas), CANDIDATES)
        canvas.path(self._dots(it.got, canvas), GOT)
        for bones, layer in ((it.plays_on, PLAYS_ON), (it.asset, ASSET), (it.chosen, CHOSEN)):
            ends = [self._dots(bones[:, i], canvas) for i in (0, 1)]
            canvas.lines(ends[0], ends[1], layer, is_thick=layer == CHOSEN)
        canvas.path(self._dots(it.wanted, canvas), WANTED, is_thick=True)
        for point in it.wanted[1:]:
            canvas.dots(self._dots(point[None], canvas) + np.array([[0, -1], [1, -1], [0, 1], [1, 1], [-1, 0], [2, 0]]), WANTED)
        return canvas

    def _dots(self, points: Floats, canvas: Canvas) -> Floats:
        return self.camera.dots(points, WIDE * canvas.width, HIGH * canvas.height)

    def render_line(self, y: int) -> Strip:
        """One line of the screen; the last one says what the colours mean."""
        width, height = self.size
        if y == height - 1 and height > 3:
            return self._legend(width)
        if self.note and y == 0:
            return Strip([Segment(fitted(self.note, width), self.rich_style)])
        if self._cells is None:
            self._cells = self.draw(width, max(1, height - 1)).cells()
        lines, layers = self._cells
        if y >= len(lines):
            return Strip.blank(width, self.rich_style)
        styles = [self.get_component_rich_style(f"stage--{name}") for name in NAMES]
        row = np.asarray(layers)[y]
        bounds = [0, *(np.flatnonzero(np.diff(row.astype(np.int16))) + 1).tolist(), len(row)]
        text = lines[y]
        return Strip([Segment(text[a:b], styles[int(row[a])]) for a, b in itertools.pairwise(bounds) if b > a])

    def _legend(self, width: int) -> Strip:
        segments = [Segment(" ", self.rich_style)]
        lines = self._visible_lines()
        for layer, text in LEGEND:
            if layer in lines and sum(len(s.text) for s in segments) + len(text) + 4 <= width:
                segments.append(Segment(f"━ {text}  ", self.get_component_rich_style(f"stage--{NAMES[layer]}")))
        return Strip(segments).adjust_cell_length(width, self.rich_style)

    def _visible_lines(self) -> set[int]:
        """The layers in which something is drawn."""
        it = self.figure
        if it is None:
            return set()
        parts = {CHOSEN: it.chosen, PLAYS_ON: it.plays_on, ASSET: it.asset, WANTED: it.wanted, GOT: it.got}
        return {layer for layer, part in parts.items() if len(part)} | ({CANDIDATES} if it.candidates else set())

    # ---- mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        self._drag = (event.x, event.y)
        self.capture_mouse()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        if self._drag is not None:
            x, y = self._drag
            self._drag = (event.x, event.y)
            self.look(self.camera.turned(DRAG * (event.x - x), DRAG * (event.y - y)))

    def on_mouse_up(self) -> None:
        self._drag = None
        self.release_mouse()

    def on_mouse_scroll_up(self) -> None:
        self.look(self.camera.zoomed(NEARER))

    def on_mouse_scroll_down(self) -> None:
        self.look(self.camera.zoomed(1.0 / NEARER))
