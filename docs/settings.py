"""Write the lists of settings in docs/format.md, out of their declarations.

python docs/settings.py
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from contextdb.files.settings import Setting, Settings, settings_of
from contextdb.motion.features.channels import CHANNEL, PERMUTATIONS
from contextdb.motion.features.schema import FeatureSchema
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.selection.controller_settings import CONTROLLER
from contextdb.motion.storage.config import SELECTOR, STEP
from contextdb.motion.storage.database_settings import DATABASE
from contextdb.schema.contracts import Contract
from contextdb.schema.outputs import OUTPUT
from contextdb.schema.shapes import BLUEPRINT, CONDITION, PROJECT
from contextdb.schema.table_settings import TableSettings

PAGE = Path(__file__).parent / "format.md"
DECLARED: dict[str, Settings] = {
    "project": PROJECT,
    "conditions": CONDITION,
    "tables": settings_of(TableSettings),
    "outputs": OUTPUT,
    "blueprints": BLUEPRINT,
    "contracts": settings_of(Contract),
    "features": settings_of(FeatureSchema),
    "channels": CHANNEL,
    "permutations": PERMUTATIONS,
    "databases": DATABASE,
    "selectors": SELECTOR,
    "order": STEP,
    "controllers": CONTROLLER,
    "output": settings_of(PoseSettings),
}
"""The lists of the page. Each stands between `<!-- settings: NAME -->` and `<!-- end -->`."""

NOTHING = ("none", "nothing", "no bound", "not declared", "not demanded", "nobody is named", "nothing is expected", "no rules")
"""What holds without a setting, where that needs no word."""


def page(text: str) -> str:
    """The page as it should be now."""
    return re.sub(
        r"(<!-- settings: (\w+) -->\n).*?(<!-- end -->)",
        lambda part: f"{part[1]}{table(DECLARED[part[2]], part[2] != 'channels')}{part[3]}",
        text,
        flags=re.S,
    )


def table(settings: Settings, has_types: bool = True) -> str:
    """The list of some settings; `has_types` where it says to which types a key belongs, and not another page."""
    rows = [f"- {_key(key, each)}: {_value(each, has_types)}\n" for key, each in settings.items()]
    return f"\n{''.join(rows)}\n"


def _key(key: str, each: Setting) -> str:
    """The key, with its default where that can be written in the file."""
    if each.is_required:
        return f"`{key}`, {each.usual}"
    return f"`{key}`" if each.without else f"`{key} = {each.usual}`"


def _value(each: Setting, has_types: bool) -> str:
    words, bounds = each.shape.words, each.shape.bounds
    is_said = all(f'"{word}"' in each.about for word in words)
    one_of = "" if is_said else f"One of {_listed(words)}."
    sentences = [each.about, one_of, bounds and f"{bounds[0].upper()}{bounds[1:]}.", each.more]
    types = has_types and each.types and f"Of type {_listed(each.types)}."
    without = each.without and each.without not in NOTHING and f"Default: {each.without}."
    return " ".join(sentence for sentence in (*sentences, types, without) if sentence)


def _listed(words: tuple[str, ...]) -> str:
    return ", ".join(f'`"{word}"`' for word in words)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
