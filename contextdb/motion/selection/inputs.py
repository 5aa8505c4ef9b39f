"""What an update of a controller is given next to its query and the valid assets, in a form that a recorder can keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.events import Event


@dataclass(frozen=True, slots=True)
class Inputs:
    """What an update was given, and by which settings it was made.

    Which assets were valid, what each cost beside, and flags and biases of frames are in `Decision.filters`.

    Attributes
    ----------
    dt_s : float
    force, interrupt : bool
    among : tuple of str, or None
        The databases of the moment; None for all.
    tags : TagFilter, or mapping of database name to TagFilter, or None
        Flags of frames are not among them.
    settings : ControllerSettings
    event : (str, float) or None
        What was to happen, and in how many seconds.
    """

    dt_s: float
    force: bool
    interrupt: bool
    among: tuple[str, ...] | None
    tags: TagFilter | Mapping[str, TagFilter] | None
    settings: ControllerSettings
    event: Event | None = None

    def tags_of(self, database: str) -> TagFilter | None:
        """The tag filter of one database."""
        return self.tags.get(database) if isinstance(self.tags, Mapping) else self.tags
