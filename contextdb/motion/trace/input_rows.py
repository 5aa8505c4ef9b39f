"""What an update was given next to query, context and valid assets, as JSON of a recorded session, and back.

Settings are kept by their names: those that another version knows and this one does not are passed over, those that it did not know
have their default.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from functools import lru_cache
from typing import Any

from contextdb.motion.markup.tag_filter import TagFilter
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.inputs import Inputs
from contextdb.motion.selection.variation import Variation

Json = dict[str, Any]
TAGS = ("include", "every", "exclude", "prefer", "avoid")


def inputs_json(inputs: Inputs) -> str:
    """Inputs as JSON; the same inputs give the same text."""
    tags = inputs.tags
    of_each = {name: _tags_row(each) for name, each in tags.items()} if isinstance(tags, Mapping) else None
    told = {
        "dt_s": float(inputs.dt_s),
        "force": bool(inputs.force),
        "interrupt": bool(inputs.interrupt),
        "among": None if inputs.among is None else list(inputs.among),
        "tags": _tags_row(tags) if isinstance(tags, TagFilter) else None,
        "tags_of": of_each,
    }
    return f'{json.dumps(told)[:-1]}, "settings": {_settings_json(inputs.settings)}}}'


@lru_cache(64)
def inputs_of(text: str) -> Inputs:
    """The inputs that a text was made of; those of one text are one. Raises ValueError, TypeError, KeyError or AttributeError where
    the text was made of none."""
    row = json.loads(text)
    tags = None if row["tags"] is None else _tags(row["tags"])
    of_each = None if row["tags_of"] is None else {name: _tags(each) for name, each in row["tags_of"].items()}
    among = None if row["among"] is None else tuple(row["among"])
    settings = _settings(json.dumps(row["settings"]))
    return Inputs(float(row["dt_s"]), bool(row["force"]), bool(row["interrupt"]), among, tags or of_each, settings)


def _tags_row(tags: TagFilter) -> Json:
    return {name: list(map(list, given) if name in TAGS[3:] else given) for name in TAGS if (given := getattr(tags, name))}


def _tags(row: Json) -> TagFilter:
    return TagFilter(*(row.get(name, ()) for name in TAGS[:3]), *(dict(row.get(name, ())) for name in TAGS[3:]))


@lru_cache(16)
def _settings_json(settings: ControllerSettings) -> str:
    return json.dumps(asdict(settings))


@lru_cache(16)
def _settings(text: str) -> ControllerSettings:
    row = json.loads(text)
    varied = row.pop("variation", None)
    known = {each.name for each in fields(ControllerSettings)}
    given = {name: value for name, value in row.items() if name in known}
    return ControllerSettings(variation=None if varied is None else Variation(**varied), **given)
