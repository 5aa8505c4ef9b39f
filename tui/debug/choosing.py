"""What the person at the debugger would have chosen: assets marked + and - at a search, written beside the session at once."""

from __future__ import annotations

from dataclasses import dataclass, field

from contextdb.errors import ContextDBError, plural
from contextdb.motion.trace.choice_pairs import choices_path, read_choices, write_choices

from .landscape import Row
from .recording import Moment

NO_FILE = "A running game has no file: record a session of it with motion.Trace, and mark assets there."


@dataclass
class Choosing:
    """The choices of a session, by tick and asset: whether the asset is preferred; `problem` says why none can be made."""

    file: str
    choices: dict[tuple[int, str], bool] = field(default_factory=dict)
    problem: str = ""

    @classmethod
    def of(cls, file: str) -> Choosing:
        """Those beside a session's file; a file of choices that cannot be read stays as it is."""
        try:
            return cls(file, {(each.tick, each.asset): each.is_preferred for each in read_choices(file)})
        except ContextDBError as error:
            return cls(file, problem=str(error))

    def at(self, tick: int) -> dict[str, bool]:
        """Those of the search at a tick, by asset."""
        return {asset: is_preferred for (each, asset), is_preferred in self.choices.items() if each == tick}

    def mark(self, moment: Moment | None, row: Row | None, is_preferred: bool) -> str:
        """Mark an asset at the search of a moment, or take the same mark back, and write it; what was done, or why not."""
        if self.problem:
            return self.problem
        if row is None or moment is None or moment.searched is None:
            return "There is no asset to mark" + (f": {moment.not_repeated}" if moment is not None and moment.not_repeated else ".")
        if not row.may_play:
            return f"{row.asset} cannot be chosen here, whatever the weights are: {row.reason}."
        key, choices = (moment.searched.tick, row.asset), dict(self.choices)
        is_back = choices.pop(key, None) is is_preferred
        if not is_back:
            choices[key] = is_preferred
        try:
            write_choices(self.file, choices)
        except ContextDBError as error:
            return str(error)
        self.choices = choices
        done = "is not marked any more" if is_back else "should have been chosen" if is_preferred else "should not have been chosen"
        where = f"{plural(len(choices), 'choice')} in {choices_path(self.file).name}"
        return f"{row.asset} {done} · {where}: contextdb motion learn learns from them."
