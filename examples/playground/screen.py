"""What is written over the picture: what plays and why, the valid rows, the gate, the ball, and the keys."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from direct.showbase.ShowBase import ShowBase
from panda3d.core import NodePath, TextNode, TextProperties, TextPropertiesManager

from examples.playground.actor import LAST_MINUTE
from examples.playground.game import Game

EXPLAIN_EVERY_S = 0.25
MOST_ROWS = 6
SIZE = 0.048
YELLOW = (1.0, 0.85, 0.3, 1.0)
SHADES = {"big": YELLOW, "plays": YELLOW, "dim": (0.68, 0.72, 0.8, 1.0), "alarm": (1.0, 0.5, 0.45, 1.0)}
HELP = """\
W A S D, arrows, left stick\twalk
Shift, right trigger\trun, until you are tired
right mouse, Q, left shoulder\tstrafe: keep facing ahead
mouse, right stick\tlook round
run or walk at the wall\tvault it
F1\tthis help
F2\tslow motion
F3\tthe page of the last minute
F4\trecord, and write what was recorded
Esc\tquit

beside it: contextdb edit examples/playground/tables"""


@dataclass
class Words:
    """What there is to say of a game. It knows no window."""

    game: Game
    _said_s: float = -1.0
    _nearest: str = ""

    @property
    def gap(self) -> str:
        """Why no row is valid, with what would have to change; "" while one is. Explained a few times a second only."""
        player = self.game.player
        if player.valid:
            return ""
        if not 0.0 <= self.game.time_s - self._said_s < EXPLAIN_EVERY_S:
            self._said_s = self.game.time_s
            self._nearest = str(player.moves.explain(player.moved.facts, unknown="any").nearest(1)[0])
        return self._nearest

    @property
    def title(self) -> str:
        """What plays."""
        player = self.game.player
        shown = player.pose.playing
        return "nothing" if shown is None else f"{shown.asset}   {shown.time_s:.2f} s"

    @property
    def why(self) -> str:
        """Why, in one sentence."""
        player = self.game.player
        if player.once is not None:
            costs = player.once.costs
            return f"It fits best: its pose and the way to its target cost {costs.total:.2f}, {costs.distance:.2f} of it the way."
        held = player.moved.decision.held
        return f"No longer valid, but held by {held}." if held else player.why

    @property
    def facts(self) -> str:
        """What the table was asked."""
        player = self.game.player
        return "  ".join(f"{name} {_short(player.moved.facts.get(name))}" for name in player.moves.asked)

    @property
    def rows(self) -> list[tuple[str, bool]]:
        """The valid rows, and whether each plays."""
        player = self.game.player
        found = [(f"{row + 1:>3}  {player.moves.assets[row]}", player.moves.assets[row] == player.playing) for row in player.valid]
        more = len(found) - MOST_ROWS
        return found if more <= 0 else [*found[:MOST_ROWS], (f"and {more} more", False)]

    @property
    def state(self) -> list[str]:
        """The rest of the game."""
        game = self.game
        lines = [f"{'tired' if game.player.is_tired else 'stamina'}  {100 * game.player.stamina:.0f} %"]
        if game.gate is not None and game.gate.seen is not None:
            lines.append(f"gate  {game.gate.seen}")
        if game.ball is not None:
            holder = game.ball.holder
            lines.append(game.ball.said if holder is not None else "the ball is free")
        if game.link is not None:
            lines.append(f"link  {game.link.name}, {'followed' if game.link.is_heard else 'nobody follows'}")
        if game.player.trace.most > LAST_MINUTE:
            lines.append(f"recording  {len(game.player.trace)} moments")
        if game.trouble:
            lines.append(f"not loaded: {game.trouble}")
        return lines


def _short(value: Any) -> str:
    return f"{value:.1f}" if isinstance(value, float) else str(value)


class Screen:
    """The words, on the screen."""

    def __init__(self, base: ShowBase, game: Game, size: float = SIZE) -> None:
        self.words, self.notice, self.shows_help = Words(game), "", False
        for name, shade in SHADES.items():
            properties = TextProperties()
            properties.setTextColor(*shade)
            properties.setGlyphScale(1.4 if name == "big" else 1.0)
            TextPropertiesManager.getGlobalPtr().setProperties(name, properties)
        wide = base.getAspectRatio()
        TextNode.getDefaultFont().setLineHeight(1.15)
        self.top = _text(base.aspect2d, -wide + 0.09, 0.92 - size, size)
        self.state = _text(base.aspect2d, -wide + 0.09, -0.68, size)
        self.middle = _text(base.aspect2d, -0.1, 0.92 - size, size)

    def show(self) -> None:
        """Write what is so now."""
        words = self.words
        listed = [_in("plays", text) if plays else text for text, plays in words.rows]
        listed = listed or [_in("alarm", "no row is valid: here"), words.gap]
        heads = [_in("big", words.title), words.why, "", _in("dim", "valid rows of moves")]
        self.top.setText("\n".join([*heads, *listed, "", _in("dim", words.facts)]))
        self.state.setText("\n".join(words.state if not self.notice else [*words.state, _in("plays", self.notice)]))
        self.middle.setText(HELP if self.shows_help else "")


def _in(style: str, text: str) -> str:
    return f"\1{style}\1{text}\2"


def _text(parent: NodePath, x: float, y: float, size: float) -> TextNode:
    """Words on a dark card."""
    node = TextNode("")
    node.setWordwrap(1.4 / size)
    node.setTabWidth(15.0)
    node.setCardColor(0.08, 0.09, 0.12, 0.72)
    node.setCardAsMargin(0.7, 0.7, 0.5, 0.4)
    node.setCardDecal(True)
    path = parent.attachNewNode(node)
    path.setScale(size)
    path.setPos(x, 0.0, y)
    return node
