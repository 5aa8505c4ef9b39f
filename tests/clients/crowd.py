"""A crowd: many contexts at once, facts that are kept, picks for all."""

import numpy as np

import contextdb as cdb


def main() -> None:
    project = cdb.Project.load("tables")
    moves = project["locomotion"].compile()
    n = 100
    facts = {"gait": np.array(["Walk"] * n), "speed": np.linspace(0, 3, n), "direction": np.zeros(n), "style": ["normal"] * n}
    many = moves.query_many(facts)
    print(many.counts.sum(), many.hits, many.rows[:3], many.starts[:3], many.assets[:3])
    crowd = moves.live_many(facts)
    crowd["speed"] = np.full(n, 1.0)
    crowd.set("gait", [1, 2], ["Run", "Run"])
    picker = moves.picker(seed=1)
    answers = crowd.query()
    for row in picker.pick_many(answers).tolist():
        print(moves.assets[row] if row >= 0 else moves.fallback)
    print([matches.assets for matches in answers][:2], picker.digest() + 1)
    report = cdb.coverage(project["locomotion"], seed=0)
    print(report.covered, [gap.share for gap in report.gaps])


main()
