"""The optional `when` column: each row's own rule, an expression over facts that must hold for the row to be valid.

    [tables.passes]
    when = "When"

    Asset Name,  gait, When
    Pass_Lead,   Run,  speed > target_speed + 1 and not is_hurt
    Pass_Safe,   Any,  Defender.distance < Receiver.distance
    Pass,        Any,

Rules are evaluated only for the rows that the masks leave, each distinct one once. A rule may name any declared condition, also
derived ones and ones that are no column of its table: their facts then belong to those that the table asks for. The language is
that of `contextdb.expressions`, whose third truth, missing, is treated as a missing fact: an error, ignored, or never.
"""

from contextdb.expressions.rules.column import WhenColumn, check_rule
from contextdb.expressions.rules.rules import ManyRules, Rule, WhenRules, facts_text

__all__ = ["ManyRules", "Rule", "WhenColumn", "WhenRules", "check_rule", "facts_text"]
