"""`make mutate` draws changes of the engines that read, the same for a seed."""

import ast
import random

from mutate import ROOT, c_places, mutations, python_places


def test_all_engines_have_places_and_a_seed_draws_the_same_ones():
    assert {one.path.rpartition("/")[0] for one in mutations()} >= {
        "contextdb/core",
        "contextdb/covering",
        "contextdb/motion/output",
    }
    assert random.Random(7).sample(mutations(), 50) == random.Random(7).sample(mutations(), 50)


def test_a_mutated_module_reads_and_differs_in_one_token():
    for one in random.Random(1).sample([one for one in mutations() if one.path.endswith(".py")], 100):
        text = (ROOT / one.path).read_text("utf-8")
        assert text[one.start : one.start + len(one.old)] == one.old != one.new
        ast.parse(text[: one.start] + one.new + text[one.start + len(one.old) :])


def test_comments_texts_and_types_are_no_places():
    assert list(python_places('x = "a < 1"  # 2 < 3\ny = x <= 1.5\n')) == [(27, "<=")]
    assert [old for _, old in c_places('/* a < b */ #define N 4\nx = a < b && c[2];\nchar *p = "1 + 1";')] == ["4", "<", "&&", "2"]
