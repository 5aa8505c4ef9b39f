"""What a check says of costs in contextdb.toml that look like those of an older version, which were sums and not means.

old-cost-scale      a threshold of a selector, or a looping or continuing bias, that no cost of today calls for
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from contextdb.cells.arguments import as_number
from contextdb.errors import SchemaError
from contextdb.files.toml_text import as_toml
from contextdb.findings import Finding
from contextdb.motion.features.schema import FeatureSchema
from contextdb.schema.settings import Schema
from contextdb.schema.toml_lines import Path

FAR_APART = 2.0
"""What two frames that have nothing to do with each other cost on average: the mean squared difference of normalised features."""
ON_PURPOSE = 1000.0
"""From here on a number says "always", on either scale."""
BIASES = ("looping_bias", "continuing_bias")


def check_costs(schema: Schema, lines: Mapping[Path, int]) -> Iterator[Finding]:
    """What is to be said of the selectors and databases of a contextdb.toml; `lines` are those of its keys."""
    for name, part in schema.selectors.items():
        steps = part.get("order")
        for i, step in enumerate(steps if isinstance(steps, list) else ()):
            threshold = as_number(step.get("threshold")) if isinstance(step, Mapping) else None
            if threshold is not None and FAR_APART <= threshold < ON_PURPOSE:
                found = f"[selectors.{name}] order {i + 1}: threshold = {as_toml(threshold)} is above {FAR_APART:g}"
                so = "so nearly every frame is under it"
                yield _finding(schema, found, so, threshold, _sum_of(schema, step.get("database")), lines.get(("selectors", name)))
    for name, part in schema.databases.items():
        for key in BIASES:
            bias = as_number(part.get(key))
            if bias is not None and -ON_PURPOSE < bias <= -FAR_APART:
                found = f"[databases.{name}] {key} = {as_toml(bias)} is more than {FAR_APART:g} below 0"
                so = "so it outweighs nearly every difference"
                yield _finding(schema, found, so, bias, _sum_of(schema, name), lines.get(("databases", name)))


def _finding(schema: Schema, found: str, so: str, number: float, total: float | None, line: int | None) -> Finding:
    told = f"{found}, which is what two unrelated frames cost on average, {so}."
    told += " Earlier versions did not divide costs by the sum of weight x features"
    told += f", here {total:g}: {as_toml(number)} of then is {number / total:.3g} today." if total else "."
    return Finding("old-cost-scale", "info", told, None, schema.file, line=line)


def _sum_of(schema: Schema, database: Any) -> float | None:
    """Weight x features, summed over the channels of a database; None where its features cannot be read."""
    part = schema.databases.get(database, {}) if isinstance(database, str) else {}
    name, own = part.get("features"), part.get("weights")
    try:
        features = FeatureSchema.from_dict(str(name), schema.features[str(name)])
    except (KeyError, SchemaError):
        return None
    weights = own if isinstance(own, Mapping) else {}
    each = ((as_number(weights.get(channel.name, channel.weight)), channel.n_features) for channel in features.channels)
    return sum((weight or 0.0) * n for weight, n in each) or None
