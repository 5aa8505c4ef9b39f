"""A feature schema as plain data, as `[features.NAME]` of contextdb.toml holds it: what `FeatureSchema.from_dict` reads back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, fields

from contextdb.motion.features.channels import KEYS, Channel
from contextdb.motion.features.permutations import Permutations
from contextdb.motion.features.schema import SCHEMA, FeatureSchema

WEIGHING = ("weight", "group")
"""The keys of a channel that change no feature, only what a difference costs."""


def schema_to_dict(schema: FeatureSchema) -> dict[str, object]:
    """The keys of a schema, and their values as JSON and TOML have them; its name and its functions are not among them."""
    given = {key: _plain(value) for key, value in _given(schema) if key in SCHEMA}
    return {**given, "channels": [_channel_to_dict(channel) for channel in schema.channels]}


def unweighted(schema: FeatureSchema) -> dict[str, object]:
    """The part of a schema that features in raw units depend on."""
    channels = [_channel_to_dict(channel) for channel in schema.channels]
    bare = [{key: value for key, value in channel.items() if key not in WEIGHING} for channel in channels]
    return {**schema_to_dict(schema), "channels": bare}


def _channel_to_dict(channel: Channel) -> dict[str, object]:
    return {key: _plain(value) for key, value in _given(channel) if key in KEYS[channel.type]}


def _given(part: FeatureSchema | Channel) -> Iterator[tuple[str, object]]:
    """The fields that are not left at their default."""
    for each in fields(part):
        value = getattr(part, each.name)
        if value != each.default:
            yield each.name, value


def _plain(value: object) -> object:
    if isinstance(value, Permutations):
        return asdict(value)
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value
