"""Every declared setting: what is accepted is said where something else stands, and docs/format.md has it."""

import contextlib
import math
import re

import numpy as np
import pytest
from strategies import for_each

from contextdb.errors import ContextDBError, SchemaError
from contextdb.files.settings import Section, Setting, settings_of
from contextdb.motion import Channel, ControllerSettings, FeatureSchema, PoseSettings, Variation
from contextdb.motion.features.channels import Permutations
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.walking.walker import WalkSettings
from contextdb.schema.contracts import SECTIONS
from contextdb.schema.settings import read_schema
from contextdb.schema.table_settings import TableSettings
from docs.settings import DECLARED, PAGE, page

ANY = ("outputs", "default")
"""What this accepts hangs on the type of the output."""
EACH = [(key, each) for section, settings in DECLARED.items() for key, each in settings.items() if (section, key) != ANY]
NUMBERS = [case for case in EACH if re.search(r" from \S+ to \S+", case[1].shape.accepted)]
CLASSES = (
    TableSettings,
    Channel,
    ControllerSettings,
    DatabaseSettings,
    FeatureSchema,
    Permutations,
    PoseSettings,
    Variation,
    WalkSettings,
)
OF_TABLES = [(section, key) for section, settings in SECTIONS.items() for key in settings or ()]
REQUIRED = {
    Channel: {"type": "phase"},
    DatabaseSettings: {"name": "a", "clips": "a.bvh", "features": "f"},
    FeatureSchema: {"name": "a", "rate": 30.0, "channels": [Channel("phase")]},
    Permutations: {"count": 1},
    TableSettings: {"name": "t"},
    Variation: {"within": 0.0},
}
OF_CLASSES = [(one, key) for one in CLASSES for key in settings_of(one)]


class Odd:
    """Something that no setting accepts."""


VALUES = [
    None, True, 0, -1, 2**70, 10**5000, 1.5, -math.inf, "", "x", "1e999", "a\0b", "\ud800", b"x", [], [5], ["x"], [[]], {}, {5: 5},
    {"x": [5]}, (1, 2), ("x", "y"), {1}, np.zeros((2, 2)), np.zeros(0), np.float32(0.5), Odd(), Odd,
]  # fmt: skip


def faults_of(key: str, each: Setting, value: object) -> list[str]:
    section = Section("[tables.jog]", {key: value}, [key], [], "contextdb.toml")
    assert section.values({key: each}) == {}
    return [str(fault) for fault in section.faults]


def bounds_of(each: Setting) -> tuple[float, float]:
    low, high = re.search(r" from (\S+) to ([^\s;]+?)(?=[,;]? |[,;]?$)", each.shape.accepted).groups()
    return float(low), float(high.replace(",", ""))


def test_the_tables_of_the_formats_are_the_declarations():
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text, "run: python docs/settings.py"
    assert set(re.findall(r"<!-- settings: (\w+) -->", text)) == set(DECLARED)


@for_each(EACH, [Odd(), math.nan, None])
def test_a_value_that_is_not_accepted_is_reported_with_its_place_its_key_and_what_is_accepted(key, each, value):
    (fault,) = faults_of(key, each, value)
    assert fault.startswith(f"contextdb.toml: [tables.jog] {key} = ")
    assert f"Accepted: {each.shape.accepted}" in fault


@for_each(OF_TABLES, ["nan", "[[1]]"])
def test_a_value_of_a_file_that_is_not_accepted_is_reported_with_its_line(section, key, value):
    header = "[project]" if section == "project" else f"[{section}.x]"
    values = ({"type": "'bool'"} if section == "conditions" else {}) | {key: value}
    lines = [header, *(f"{key} = {value}" for key, value in values.items())]
    with pytest.raises(SchemaError) as error:
        read_schema("\n".join(lines), "contextdb.toml")
    assert str(error.value).startswith(f"contextdb.toml, line {len(lines)}: {header} {key} = ")
    assert f"Accepted: {SECTIONS[section][key].shape.accepted}" in str(error.value)


@for_each(EACH)
def test_a_misspelt_key_is_reported_with_the_one_that_was_meant(key, each):
    section = Section("[tables.jog]", {f"{key}x": 1}, {key: each}, [], "contextdb.toml")
    assert [str(fault) for fault in section.faults] == [
        f'contextdb.toml: [tables.jog] has no key "{key}x". Accepted: "{key}". Did you mean "{key}"?'
    ]


@for_each(EACH)
def test_a_setting_is_missed_only_where_it_is_required(key, each):
    section = Section("[tables.jog]", {}, {key: each}, [])
    assert section.values({key: each}) == {}
    assert [fault.accepted for fault in section.faults] == [each.shape.accepted] * each.is_required


@for_each(NUMBERS)
def test_a_number_is_accepted_from_one_named_bound_to_the_other_and_not_beyond(key, each):
    low, high = bounds_of(each)
    for value in (low, high):
        section = Section("", {key: value}, [key], [])
        assert section.values({key: each}) == {key: value}
    for value in (low - 1.0, math.nextafter(low, -math.inf), math.nextafter(high, math.inf), high + 1.0):
        assert "this is out of range" in faults_of(key, each, value)[0] or "whole" in each.shape.accepted


@for_each(EACH)
def test_a_default_and_an_example_are_accepted(key, each):
    if each.default not in (None, (), {}) and not each.is_required:
        assert each.shape.wrong(each.default) is None
    example = re.search(r"such as (-?[\d.]+)(?=[,;]|$)", each.shape.accepted)
    assert example is None or each.shape.wrong(float(example[1])) is None


@for_each(OF_CLASSES, [Odd(), math.nan])
def test_settings_made_in_python_are_checked_as_those_of_a_file(made, key, value):
    with pytest.raises(ContextDBError, match=re.escape(f"{key} = ")) as error:
        made(**REQUIRED.get(made, {}) | {key: value})
    each = settings_of(made)[key]
    assert error.value.faults[0].accepted == (each.in_python or each.shape).accepted
    assert made(**REQUIRED.get(made, {})) == made(**REQUIRED.get(made, {}))


@pytest.mark.parametrize("made", CLASSES)
def test_help_lists_every_setting_with_its_default(made):
    assert all(f"    {key}\n        {each.summary}" in made.__doc__ for key, each in settings_of(made).items())


@for_each(OF_CLASSES)
def test_no_value_of_a_setting_ends_in_another_error(made, key):
    for value in VALUES:
        with contextlib.suppress(ContextDBError):
            made(**REQUIRED.get(made, {}) | {key: value})
