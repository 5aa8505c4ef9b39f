"""The compiled file for the game: .safetensors, opened by memory map, never pickle.

Tensors, R rows, W = ceil(R / 64) words, C conditions; every integer and double little-endian, every mask as in `contextdb.bitmask`:

    enabled                uint64 [W]            rows that may match
    priorities             int64 [R]
    row_weights            float64 [R]
    assets                 uint8                 JSON list of R texts
    ranks                  float64 [R]           what the policy ranks rows by before chance and costs, higher first
    specificities          float64 [R]           where the policy looks at it: what the ranks say of the cells
    once                   bool [R]              where rows are played once at most
    cooldown_s             float64 [R]           where rows rest for seconds
    cooldown_turns         int64 [R]             where rows rest for picks
    declared               uint8                 JSON list of the project's conditions: a fact of such a name is no typo
    CCC.FIELD              of condition number CCC, from 000 in the order of `about`; see contextdb.compiled.classes:
                           masks uint64 [n, W], of numbers also bounds float64 [K - 1], ascending; or, of very many bounds,
                           low and high uint64 [L, 2 G + F, W] and any_mask uint64 [W]
    CCC.codes              int32 [R]             which of the distinct texts each row holds
    CCC.texts              uint8                 JSON list of the distinct texts
    CCC.hysteresis         float64 [1]           where the condition has one
    slots.CCC.codes        as CCC.codes and CCC.texts, for the columns of slots, named in `about`
    slots.CCC.texts
    outputs.declared       uint8                 JSON list: name, type, default, bounds, values, size, unit, description of each
    outputs.CCC.values     output CCC, of bool, int, number: uint8 (0 or 1), int64, float64 [R + 1]; numbers: float64 [R + 1, size]
    outputs.CCC.codes      int32 [R + 1]         of enum and text: which of the texts
    outputs.CCC.texts      uint8                 JSON list; of an enum its values in their order, then "" for none
    outputs.plays          float64 [R + 1, 8]    how rows play, with a reserved output only: blend_s, start_s, the least and the
                           greatest play_rate, then as numbers mirror (as asked, always, never), loop, root (animation, code,
                           mixed, path) and until (natural, any); NaN where the row says nothing. See contextdb.cells.row_play
    when.codes             as CCC.codes and CCC.texts, for the column of rules, named in `about`
    when.texts
    CCC.soft.FIELD         the same for soft cells, and CCC.soft.penalties float64 [R]
    CCC.soft.per           float64 [K], starts int64 [K + 1], ends float64 [S, 2] and which int32 [R]: where penalties grow with the
                           distance of a fact, see contextdb.compiled.layers

Value R of an output is what there is without a row: what `fallback` gives, else the default, else False, 0, NaN or "". Infinite
defaults are "inf" and "-inf" in the JSON. What knows no outputs passes all of these over: they change no answer.

For a table with rules or derived facts, P programs of D derived facts and then of the rules, which name F facts
(`contextdb.compiled.programs`; Python does not read them):

    programs.code          int32 [N, 4]          the instructions: an `Op` and three operands
    programs.starts        int64 [P + 1]         where each program begins in `code`
    programs.numbers       float64               what instructions name by number
    programs.texts         uint8                 JSON list of texts, likewise
    programs.facts         uint8                 JSON list of F names of conditions
    programs.types         uint8                 JSON list of their types
    programs.derived       int64 [D]             which of these facts each program computes, each behind those that it needs
    programs.of_row        int32 [R]             which rule each row has, from 0; -1 for none. [0] where no row has one

For a table with tables inside, D the depth, T the number of tables (`contextdb.compiled.ways`; soft cells then have D R rows):

    ways.numbers           int32 [D, R]
    ways.rows              int32 [D, R]
    ways.leaves            uint8                 JSON list of R texts
    ways.TTT.FIELD         priorities, ranks, row_weights and lines of table number TTT; specificities, once, cooldown_s and
                           cooldown_turns where it has them, which then are nowhere else
    CCC.layers             int32 [D, R]          which text each depth says
    CCC.said               uint8                 JSON list of those texts
    when.layers, when.said                       the same for the rows' own rules

The metadata hold `contextdb` (the version of this layout), `about` (JSON: name, policy, fallback, conditions and the kind of each
column; where facts are derived also the conditions that they are computed from; where rows have rules also their column and the
conditions that they name and that are not columns) and `digest`, BLAKE2b-128 of `about` and of all
tensors in the order of their names. Opening checks all of it. `about` names the policy of each table and says how
it picks, so that a reader needs no names: `choose` among the rows of the highest rank ("chance", "top", where each row has a rank
of its own, "refuse") and `by_cost`, only those whose soft cells cost least (`contextdb.schema.policies`).

The `kind` of a column says which mask a fact has; the last one is for a missing fact:

    value     masks[i] for the fact that is values[i]; with `has_others` any other text has the mask after those
    number    masks[k], k the number of bounds that are not above the fact; an angle is first wrapped to -180 up to, without, 180
    wide      with that k, g = k >> shift, f = k & (2 ** shift - 1), F = 2 ** shift: the union over the L layers of
              (low[g] | low[G + g] & low[2 G + f]) & (high[g] | high[G + g] & high[2 G + f]); `any_mask` for a missing fact
    tags      three masks (no, yes, missing) for each of `tags` and then of `negated`: the intersection of masks[3 s + answer] over
              all slots s. A fact has a tag when it holds the tag or one below it. A slot of `negated` is [needs, bans], yes unless
              the fact has all of `needs` and none of `bans`; or, where cells of nested tables meet, a list of parts [needs, bans,
              is_complement], yes when the fact is in every part

An answer is the intersection of `enabled` and the masks of all facts. With `computed_from` in `about` conditions are derived from
other facts by the `expr` stored with them; with `when` only rows count whose rule is true, too; with `ways` the masks are of
the flat rows. A reader refuses a file whose `about` has a key that it does not know.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.sets import TagMeet, TagSet
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.data import CompiledData
from contextdb.compiled.layers import GROWTH, Growth, SoftMasks
from contextdb.compiled.outputs_stored import (
    known_policy,
    outputs_from,
    outputs_to_tensors,
    policy_to_json,
    ways_from,
    ways_to_json,
    ways_to_tensors,
)
from contextdb.compiled.pick_columns import PickColumns
from contextdb.files.tensors import (
    FileKind,
    Tensors,
    digest_of,
    read_tensors,
    texts_from_array,
    texts_to_array,
    write_tensors,
)
from contextdb.schema.settings import Schema, derivation_of

if TYPE_CHECKING:
    from contextdb.expressions import Derivation
    from contextdb.expressions.rules import WhenRules

COMPILED = FileKind(
    "contextdb", 4, "one that contextdb compiled", "a file that this version of contextdb compiled", "to compile the table again"
)


def save(compiled: CompiledData, path: Path) -> None:
    """Write a compiled table; the old file is whole until the new one is."""
    tensors: Tensors = {
        "enabled": compiled.enabled,
        "priorities": compiled.priorities,
        "ranks": compiled.ranks,
        "row_weights": compiled.row_weights,
        "assets": texts_to_array(list(compiled.assets)),
        "declared": texts_to_array(sorted(compiled.declared)),
    }
    kinds = []
    for at, (masks, soft, texts) in enumerate(zip(compiled.masks, compiled.soft, compiled.texts, strict=True)):
        kinds.append(
            {"masks": _add(tensors, f"{at:03d}", masks), "soft": None if soft is None else _add(tensors, f"{at:03d}.soft", soft[0])}
        )
        tensors[f"{at:03d}.codes"] = texts.codes
        tensors[f"{at:03d}.texts"] = texts_to_array(list(texts.texts))
        if reach := compiled.conditions[at].hysteresis:
            tensors[f"{at:03d}.hysteresis"] = np.array([reach])
        if soft is not None:
            tensors[f"{at:03d}.soft.penalties"] = soft.penalties
            if soft.growth is not None:
                tensors |= {f"{at:03d}.soft.{part}": array for part, array in zip(GROWTH, soft.growth.arrays, strict=True)}
    for at, column in enumerate(compiled.slots or ()):
        tensors[f"slots.{at:03d}.codes"] = column.codes
        tensors[f"slots.{at:03d}.texts"] = texts_to_array(list(column.texts))
    tensors |= outputs_to_tensors(compiled.outputs)
    if compiled.when is not None:
        tensors["when.codes"] = compiled.when.texts.codes
        tensors["when.texts"] = texts_to_array(list(compiled.when.texts.texts))
    tensors |= _programs(compiled)
    tensors |= compiled.picking.arrays
    if compiled.ways is not None:
        tensors |= ways_to_tensors(compiled.ways)
    about = json.dumps(
        {
            "name": compiled.name,
            "rows": compiled.n_rows,
            **policy_to_json(compiled.policy),
            "fallback": compiled.fallback,
            "conditions": [_condition_to_json(c) for c in compiled.conditions],
            "columns": kinds,
        }
        | ({"slots": [c.name for c in compiled.slots]} if compiled.slots is not None else {})
        | ({"computed_from": [_condition_to_json(c) for c in _computed_from(compiled)]} if compiled.derivation else {})
        | ({"when": _when_to_json(compiled)} if compiled.when else {})
        | ({"ways": ways_to_json(compiled.ways)} if compiled.ways else {})
    )
    write_tensors(path, COMPILED, tensors, {"about": about, "digest": digest_of(tensors, about, str(COMPILED.layout))})


def _programs(compiled: CompiledData) -> Tensors:
    if compiled.derivation is None and compiled.when is None:
        return {}
    from contextdb.compiled.programs import programs_of, programs_to_tensors

    return programs_to_tensors(programs_of(compiled.derivation, compiled.when))


def open_artefact(path: Path) -> CompiledData:
    """Open a compiled table by memory map, checked. Raises ArtefactError where the file is truncated, altered, of another layout,
    or no artefact at all; with the reason and the mend; FileError where the file cannot be read."""
    tensors, metadata = read_tensors(path, COMPILED)
    with COMPILED.reading(path):
        about = metadata["about"]
        if digest_of(tensors, about, metadata[COMPILED.key]) != metadata.get("digest"):
            raise COMPILED.refused(path, "the file was altered: its contents do not match its digest.")
        compiled = _table(json.loads(about), tensors)
        _ = compiled.core  # it checks that the arrays go together
        return compiled


def _table(about: dict[str, Any], tensors: Tensors) -> CompiledData:
    conditions = tuple(_condition_from_json(c) for c in about["conditions"])
    n_rows = about["rows"]
    numbered = [(f"{at:03d}", kinds) for at, kinds in enumerate(about["columns"])]
    return CompiledData(
        name=about["name"],
        assets=texts_from_array(tensors["assets"]),
        conditions=conditions,
        masks=tuple(_column(tensors, prefix, kinds["masks"], n_rows) for prefix, kinds in numbered),
        enabled=tensors["enabled"],
        soft=tuple(
            _soft(tensors, f"{prefix}.soft", kinds["soft"], condition.domain)
            for (prefix, kinds), condition in zip(numbered, conditions, strict=True)
        ),
        priorities=tensors["priorities"],
        row_weights=tensors["row_weights"],
        texts=tuple(
            TextColumn(c.name, tuple(texts_from_array(tensors[f"{prefix}.texts"])), tensors[f"{prefix}.codes"])
            for c, (prefix, _) in zip(conditions, numbered, strict=True)
        ),
        policy=known_policy(about["policy"]),
        fallback=about["fallback"],
        derivation=_derivation(about, conditions),
        slots=_slots(about, tensors),
        when=_when(about, conditions, tensors),
        ways=ways_from(about["ways"], tensors, len(conditions)) if "ways" in about else None,
        declared=frozenset(texts_from_array(tensors["declared"]) if "declared" in tensors else ()),
        outputs=outputs_from(tensors, n_rows),
        picking=PickColumns.of(tensors.get),
    )


def _when_to_json(compiled: CompiledData) -> dict[str, object]:
    assert compiled.when is not None
    return {"name": compiled.when.name, "conditions": [_condition_to_json(c) for c in compiled.ruled]}


def _when(about: dict[str, Any], conditions: tuple[Condition, ...], tensors: Tensors) -> WhenRules | None:
    if "when" not in about:
        return None
    from contextdb.expressions.rules import WhenColumn, WhenRules

    known = {c.name: c for c in (*conditions, *map(_condition_from_json, about["when"]["conditions"]))}
    texts = TextColumn(about["when"]["name"], tuple(texts_from_array(tensors["when.texts"])), tensors["when.codes"])
    column = WhenColumn.read(texts, known)
    if column.faults:
        raise ValueError(column.faults)
    return WhenRules.of(column)


def _slots(about: dict[str, Any], tensors: Tensors) -> tuple[TextColumn, ...] | None:
    if "slots" not in about:
        return None
    return tuple(
        TextColumn(name, tuple(texts_from_array(tensors[f"slots.{at:03d}.texts"])), tensors[f"slots.{at:03d}.codes"])
        for at, name in enumerate(about["slots"])
    )


def _derivation(about: dict[str, Any], conditions: tuple[Condition, ...]) -> Derivation | None:
    if "computed_from" not in about:
        return None
    from contextdb.expressions import ExpressionError

    others = [_condition_from_json(c) for c in (*about["computed_from"], *about.get("when", {"conditions": ()})["conditions"])]
    known = Schema(conditions={c.name: c for c in (*conditions, *others)})
    try:
        return derivation_of(known, known.conditions)
    except ExpressionError as error:
        raise ValueError(error.faults) from None


def _computed_from(compiled: CompiledData) -> list[Condition]:
    """The conditions that derived facts are computed from and that are not columns of the table."""
    computed = compiled.derivation.conditions if compiled.derivation else ()
    return [condition for condition in computed if condition.name not in compiled.places]


def _add(tensors: Tensors, prefix: str, masks: ColumnMasks) -> dict[str, object]:
    """Put a column's arrays among the tensors; gives what else it needs."""
    if isinstance(masks, WideMasks):
        tensors |= {
            f"{prefix}.bounds": masks.bounds,
            f"{prefix}.low": masks.low,
            f"{prefix}.high": masks.high,
            f"{prefix}.any_mask": masks.any_mask,
        }
        return {"kind": "wide", "shift": masks.shift}
    tensors[f"{prefix}.masks"] = masks.masks
    if isinstance(masks, NumberMasks):
        tensors[f"{prefix}.bounds"] = masks.bounds
        return {"kind": "number"}
    if isinstance(masks, ValueMasks):
        return {"kind": "value", "values": list(masks.values), "has_others": masks.has_others}
    negated = [[_tags_to_json(p) for p in t.parts] if isinstance(t, TagMeet) else _tags_to_json(t)[:2] for t in masks.negated]
    return {"kind": "tags", "tags": list(masks.tags), "negated": negated}


def _column(tensors: Tensors, prefix: str, about: dict[str, Any], n_rows: int) -> ColumnMasks:
    kind = about["kind"]
    if kind == "wide":
        parts = (tensors[f"{prefix}.{part}"] for part in ("low", "high", "any_mask"))
        return WideMasks(n_rows, tensors[f"{prefix}.bounds"], about["shift"], *parts)
    masks = tensors[f"{prefix}.masks"]
    if kind == "number":
        return NumberMasks(n_rows, tensors[f"{prefix}.bounds"], masks)
    if kind == "value":
        return ValueMasks(n_rows, tuple(about["values"]), about["has_others"], masks)
    negated = tuple(_negated(parts) for parts in about["negated"])
    return TagMasks(n_rows, tuple(about["tags"]), negated, masks)


def _soft(tensors: Tensors, prefix: str, about: dict[str, Any] | None, domain: Domain) -> SoftMasks | None:
    if about is None:
        return None
    penalties, growth = tensors[f"{prefix}.penalties"], None
    if f"{prefix}.per" in tensors:
        per, starts, ends, which = (tensors[f"{prefix}.{part}"] for part in GROWTH)
        growth = Growth(per, starts, ends, which, domain.type.is_circular)
        growth.check(len(penalties))
    return SoftMasks(_column(tensors, prefix, about, len(penalties)), penalties, growth)


def _tags_to_json(tags: TagSet) -> list[object]:
    return [sorted(tags.needs), sorted(tags.bans), tags.is_complement]


def _negated(parts: list[Any]) -> TagSet:
    """A set of tags with a "not": what it needs and bans; or the parts of a meet, each with whether it is a complement."""
    if len(parts) == 2 and all(isinstance(name, str) for names in parts for name in names):
        return TagSet(frozenset(parts[0]), frozenset(parts[1]), True)
    return TagMeet.of([TagSet(frozenset(needs), frozenset(bans), is_complement) for needs, bans, is_complement in parts])


def _condition_to_json(condition: Condition) -> dict[str, object]:
    domain = condition.domain
    bounds = [b if math.isfinite(b) else None for b in (domain.minimum, domain.maximum)]
    return {
        "name": condition.name,
        "type": domain.kind,
        "values": domain.values,
        "bounds": bounds,
        "unit": condition.unit,
        "description": condition.description,
        "expr": condition.expr,
        "is_declared": condition.is_declared,
        **({} if condition.mirror is None else {"mirror": condition.mirror}),
        **({"hysteresis": condition.hysteresis} if condition.hysteresis else {}),
    }


def _condition_from_json(about: dict[str, Any]) -> Condition:
    low, high = about["bounds"]
    values = None if about["values"] is None else tuple(about["values"])
    domain = Domain(about["type"], values, -math.inf if low is None else low, math.inf if high is None else high)
    own = about["name"], domain, about["unit"], about["description"], about["expr"], about["is_declared"], _mirror(about)
    return Condition(*own, hysteresis=float(about.get("hysteresis", 0.0)))


def _mirror(about: dict[str, Any]) -> Any:
    mirror = about.get("mirror")
    return tuple((left, right) for left, right in mirror) if isinstance(mirror, list) else mirror
