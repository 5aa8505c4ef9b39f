"""A table that was made ready loads nothing more when it is asked."""

import subprocess
import sys
from pathlib import Path

import pytest
import strategies
from hypothesis import given

PROGRAM = """
import sys
import contextdb as cdb
table = cdb.load(sys.argv[1]).compile()
table.prepare(casting=True, batches=True)
modules = set(sys.modules)
facts = {c.name: c.domain.values[0] if c.domain.values else 1.0 for c in table.conditions}
facts |= {c.name: True for c in table.conditions if c.domain.kind == "bool"}
table.pick(table.query(facts), 1)
picker = table.picker()
picker.pick(table.query(facts)).why
table.live(facts).matches()
plain = {name: fact for name, fact in facts.items() if "." not in name}
actors = {"Defender": [{n.partition(".")[2]: f for n, f in facts.items() if "." in n}]} if len(plain) < len(facts) else {}
table.query(plain, actors=actors)
live = table.live(plain)
live.actors(actors)
live.matches()
for n in (1, 3, 20000):
    many = table.query_many({name: [fact] * n for name, fact in facts.items()})
    many.counts, many.hits, many.mask, many[0], len(many.lists()), picker.pick_many(many)
print(sorted(m for m in set(sys.modules) - modules if m.startswith("contextdb")))
"""
SAMPLES = Path(__file__).parent.parent / "tables"


@pytest.mark.parametrize("name", ["locomotion", "contested_catch"])
def test_after_prepare_nothing_is_loaded_for_the_first_time(name: str):
    command = [sys.executable, "-c", PROGRAM, str(SAMPLES / f"{name}.csv")]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert said.split("\n")[0] == "[]"


@given(strategies.tables())
@strategies.examples(0.2)
def test_any_table_can_be_prepared(table):
    table.compile().prepare(casting=True, batches=True)
