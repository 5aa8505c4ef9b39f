"""Write the tables of settings in docs/format.md, out of their declarations.

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
"""The tables of the page. Each stands between `<!-- settings: NAME -->` and `<!-- end -->`."""


def page(text: str) -> str:
    """The page as it should be now."""
    return re.sub(
        r"(<!-- settings: (\w+) -->\n).*?(<!-- end -->)",
        lambda part: f"{part[1]}{table(DECLARED[part[2]], part[2] != 'channels')}{part[3]}",
        text,
        flags=re.S,
    )


def table(settings: Settings, has_types: bool = True) -> str:
    """The table of some settings; `has_types` where it says to which types a key belongs, and not another page."""
    rows = "".join(f"| `{key}` | {_value(each, has_types)} | {_usual(each)} |\n" for key, each in settings.items())
    return f"\n| key | value | without it |\n| --- | --- | --- |\n{rows}\n"


def _value(each: Setting, has_types: bool) -> str:
    words, bounds = each.shape.words, each.shape.bounds
    sentences = [each.about, words and f"One of {_listed(words)}.", bounds and f"{bounds[0].upper()}{bounds[1:]}.", each.more]
    types = has_types and each.types and f"Of type {_listed(each.types)}."
    return " ".join(sentence for sentence in (*sentences, types) if sentence)


def _usual(each: Setting) -> str:
    return each.usual if each.without or each.is_required else f"`{each.usual}`"


def _listed(words: tuple[str, ...]) -> str:
    return ", ".join(f'`"{word}"`' for word in words)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
