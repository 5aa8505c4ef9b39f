"""What there is to say of a game: what plays and why, the valid rows, the gate, the ball. It knows no window."""

from __future__ import annotations

from examples.playground.actor import LAST_MINUTE
from examples.playground.game import Game

EXPLAIN_EVERY_S, MOST_ROWS = 0.25, 6


class Words:
    """The words of a game, as they are now."""

    def __init__(self, game: Game) -> None:
        self.game, self._said_s, self._nearest = game, -1.0, ""

    @property
    def gap(self) -> str:
        """Why no row is valid, with what would have to change; "" while one is. Explained a few times a second only."""
        player = self.game.player
        if player.valid:
            return ""
        if not 0.0 <= self.game.time_s - self._said_s < EXPLAIN_EVERY_S:
            self._said_s = self.game.time_s
            facts = {name: round(fact, 1) if isinstance(fact, float) else fact for name, fact in player.moved.facts.items()}
            self._nearest = str(player.moves.explain(facts, unknown="any").nearest(1)[0])
        return self._nearest

    @property
    def title(self) -> str:
        """What plays."""
        shown = self.game.player.pose.playing
        return "nothing" if shown is None else f"{shown.asset}   {shown.time_s:.2f} s"

    @property
    def why(self) -> str:
        """Why, in one sentence."""
        player, held = self.game.player, self.game.player.moved.decision.held
        if player.once is not None:
            costs = player.once.costs
            if player.once_of == "contest":
                role = player.playing.split(".")[-1]
                return f"Clip, frame and cast were found together; its own part, {role}, costs {costs.total:.2f}."
            return f"It fits best: its pose and the way to its target cost {costs.total:.2f}, {costs.distance:.2f} of it the way."
        return f"No longer valid, but held by {held}." if held else player.why

    @property
    def facts(self) -> str:
        """What the table was asked."""
        asked = {name: self.game.player.moved.facts.get(name) for name in self.game.player.moves.asked}
        return "  ".join(f"{name} {fact:.1f}" if isinstance(fact, float) else f"{name} {fact}" for name, fact in asked.items())

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
        game, player = self.game, self.game.player
        lines = [f"{'tired' if player.is_tired else 'stamina'}  {100 * player.stamina:.0f} %"]
        if game.gate is not None and game.gate.seen is not None:
            lines.append(f"gate  {game.gate.seen}")
        if game.ball is not None:
            lines.append("the ball is free" if game.ball.holder is None else game.ball.said)
        if game.link is not None:
            lines.append(f"link  {game.link.name}, {'followed' if game.link.is_heard else 'nobody follows'}")
        if player.trace.most > LAST_MINUTE:
            lines.append(f"recording  {len(player.trace)} moments")
        return lines if not game.trouble else [*lines, f"not loaded: {game.trouble}"]
