"""The settings of a variant: those of its base where it says nothing itself, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from contextdb.files.settings import settings_of
from contextdb.schema.table_settings import TableSettings

OWN = ("file", "base", "remove", "expected", "owner")
"""The settings that a variant does not inherit."""
INHERITED = tuple(key for key in settings_of(TableSettings) if key not in (*OWN, "outputs", "fallback"))
_PLAIN = TableSettings("")


def with_inherited(own: TableSettings, base: TableSettings) -> TableSettings:
    """The settings of a variant of a table with other settings; it has the outputs of both."""
    given: dict[str, Any] = {key: _first(getattr(own, key), getattr(base, key), getattr(_PLAIN, key)) for key in INHERITED}
    typed = {output.name: output for output in (*base.typed, *own.typed)}
    fallback = own if own.fallback is not None else base
    return replace(
        own,
        **given,
        outputs=tuple(dict.fromkeys((*base.outputs, *own.outputs))),
        typed=tuple(typed.values()),
        fallback=fallback.fallback,
        fallback_outputs=fallback.fallback_outputs,
    )


def without_inherited(settings: TableSettings, base: TableSettings) -> TableSettings:
    """What a variant itself says, of its settings and those of its base."""
    own: dict[str, Any] = {key: getattr(_PLAIN, key) for key in INHERITED if getattr(settings, key) == getattr(base, key)}
    outputs = tuple(name for name in settings.outputs if name not in base.outputs)
    typed = tuple(output for output in settings.typed if output not in base.typed)
    if (settings.fallback, settings.fallback_outputs) == (base.fallback, base.fallback_outputs):
        own |= {"fallback": None, "fallback_outputs": ()}
    return replace(settings, **own, outputs=outputs, typed=typed)


def resolved(settings: TableSettings, tables: Mapping[str, TableSettings]) -> TableSettings:
    """The settings of a table with what it inherits; `tables` are those that are declared. A cycle of bases is cut."""
    chain = [settings]
    while (base := chain[-1].base) is not None and base in tables and all(base != one.name for one in chain):
        chain.append(tables[base])
    whole = chain.pop()
    while chain:
        whole = with_inherited(chain.pop(), whole)
    return whole


def _first(own: object, base: object, nothing: object) -> object:
    return base if own == nothing else own
