"""Turned weights, written into the project's contextdb.toml."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from contextdb.authoring.weights import weights_change
from contextdb.edits.schema_file import SchemaChange

from .recording import Recording, Turned


def write_turned(recording: Recording, turned: Turned) -> Iterator[SchemaChange | None]:
    """Write weights and thresholds into contextdb.toml, a section at a time, and give what was written."""
    config, path = recording.config, Path(recording.schema_file)
    assert config is not None, "was looked at before"
    selector = config.selector_of(recording.controller) if recording.controller in config.controllers else ""
    if not selector and turned.thresholds:
        databases = set(turned.thresholds)
        selector = next((name for name, each in config.selectors.items() if databases <= {db for db, _ in each.order}), "")
    named = dict.fromkeys(config.databases[name].features for name in recording.databases if name in config.databases)
    for features in named:
        channels = {channel.name for channel in config.features[features].channels}
        weights = {name: weight for name, weight in turned.weights.items() if name in channels}
        yield _written(weights_change(path, features, weights))
    if turned.thresholds:
        yield _written(weights_change(path, next(iter(named), ""), {}, selector, turned.thresholds))


def _written(change: SchemaChange | None) -> SchemaChange | None:
    if change is not None:
        change.write()
    return change
