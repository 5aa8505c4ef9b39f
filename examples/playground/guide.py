"""The first minute: what the screen asks the player to do, step by step, until a row that was missing plays."""

import math

from contextdb.cells.facts import Context

from .game import Game

AHEAD_S, STUCK_S, BYE_S = 1.5, 0.4, 9.0
"""How long to walk ahead, how long without a valid row, and how long the last words stay."""
WALK = "Hold W to walk. Each frame the game asks a table which clips may play; the list on the left is its answer."
BACK = "Now hold Q and press S: step back while you face ahead."
GAP = """No row is valid, so the last clip goes on: the table lacks a row. In the editor, Alt+4 and L list
the gap, and Enter makes its row; type the clip, walk_back, press Enter, and Ctrl+S to save."""
NAMELESS = "The new row is valid, but names no clip. Type walk_back into its first cell, press Enter, and Ctrl+S."
AGAIN = "The table has changed, and the game plays on. Hold Q and press S again."
DONE = "{} plays: you have changed a running game by a row. F1 has the keys; docs/playground.md has more to try."


class Guide:
    """Where the player is in the first minute; `text` is what the screen says, "" once it is over."""

    def __init__(self, game: Game) -> None:
        self.game, self.text = game, WALK
        self._since_s, self._version = 0.0, game.watch.snapshot().number

    def update(self, dt: float) -> None:
        """Look at what the player did in this frame."""
        facts, rows = self.game.player.moved.facts, self.game.player.readout.rows
        is_back, plays = _is_back(facts), any(is_playing for _, is_playing in rows)
        if self.text == WALK:
            self._count(dt, facts["gait"] != "Idle", AHEAD_S, BACK)
        elif self.text == BACK:
            if is_back and plays:
                self._say(DONE.format(self.game.player.playing))
            else:
                self._count(dt, is_back and not rows, STUCK_S, GAP)
        elif self.text in (GAP, NAMELESS) and self.game.watch.snapshot().number != self._version:
            self._say(AGAIN)
        elif self.text == AGAIN and is_back:
            self._version = self.game.watch.snapshot().number
            if plays:
                self._say(DONE.format(self.game.player.playing))
            else:
                self._count(dt, True, STUCK_S, NAMELESS if rows else GAP)
        elif self.text and self.text not in (GAP, NAMELESS, AGAIN):
            self._count(dt, True, BYE_S, "")

    def _count(self, dt: float, is_so: bool, seconds: float, then: str) -> None:
        """Go on once something has been so for some seconds."""
        self._since_s += dt if is_so else 0.0
        if self._since_s >= seconds:
            self._say(then)

    def _say(self, text: str) -> None:
        self.text, self._since_s = text, 0.0


def _is_back(facts: Context) -> bool:
    """Whether the player steps back while facing ahead."""
    direction = facts.get("direction")
    is_behind = isinstance(direction, float) and abs(math.remainder(direction, 360.0)) > 120.0
    return bool(facts.get("strafe")) and is_behind and facts["gait"] != "Idle"
