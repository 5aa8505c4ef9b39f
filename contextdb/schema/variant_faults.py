"""What is wrong with the variants of a contextdb.toml: each fault with the path of the key it is about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from contextdb.errors import Fault
from contextdb.files.toml_shapes import key_value
from contextdb.schema.parts import Part, header
from contextdb.schema.table_settings import JOBS
from contextdb.schema.toml_lines import Path


def variant_faults(tables: Mapping[str, Part]) -> Iterator[tuple[Path, Fault]]:
    """Columns that have another job than in the base, and what only a variant can have. Whether there is a table of the base's name
    shows when tables are read."""
    for name, part in tables.items():
        path = ("tables", name)
        if "remove" in part and "base" not in part:
            problem = f"{header(path)} {key_value('remove', part['remove'])} has no place here: the table is no variant."
            yield (*path, "remove"), Fault(problem, 'base = "TABLE"', "to leave it out")
        inherited = bases_of(name, tables)[1:]
        for job in JOBS:
            of = next((base for base in inherited if job in tables[base] and job != "remove"), None)
            if job in part and of is not None and part[job] != tables[of][job]:
                problem = f"{header(path)} {key_value(job, part[job])}: its base has another."
                mend = key_value(job, tables[of][job])
                yield (*path, job), Fault(problem, f"the column of {header(('tables', of))}, or none", mend)


def bases_of(name: str, tables: Mapping[str, Part]) -> list[str]:
    """A table and those that it is a variant of, as far as they are declared."""
    chain = [name]
    while (base := tables[chain[-1]].get("base")) in tables and base not in chain:
        chain.append(str(base))
    return chain
