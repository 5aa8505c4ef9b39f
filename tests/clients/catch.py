"""A catch: actors who are cast for a role, and why nothing is valid."""

from facts import ContestedCatchActors, ContestedCatchFactsWithActors, ContestedCatchTable

import contextdb as cdb


def main() -> None:
    catch = ContestedCatchTable.of(cdb.load("tables/contested_catch.csv").compile())
    facts: ContestedCatchFactsWithActors = {"MidAir_Catch_Direction": "Going_Down"}
    actors: ContestedCatchActors = {
        "Defender": [
            {"id": 21, "DepthChart": "FS", "MidAir_Contesting": True, "CatchingAnim": False, "Catching": False, "FacingBall": True}
        ]
    }
    valid = catch.query(facts, actors=actors, unknown="any")
    for role, actor in catch.picker().pick(valid).casting.items():
        print(role, actor.get("id"), actor["DepthChart"])
    for one in catch.explain(facts, actors=actors, unknown="any").nearest(2):
        print(one.asset, [(failure.condition, failure.mend) for failure in one.failures])


main()
