"""A guard: facts that are kept, a picker that remembers, a link, hot reload."""

from facts import LocomotionFacts, LocomotionTable

import contextdb as cdb


def main() -> None:
    moves = LocomotionTable.open("build/locomotion.safetensors")
    facts: LocomotionFacts = {"gait": "Walk", "speed": 1.3, "direction": 0.0, "style": "normal"}
    valid = moves.query(facts)
    print([asset.upper() for asset in valid], valid.rows.tolist(), valid[0], len(valid))
    live = moves.live(facts)
    live["speed"] = 3.2
    live.update({"gait": "Run"})
    pick = moves.picker(seed=7, memory=2).pick(live.query(), time_s=0.5)
    row: int | None = pick.row
    name: str | None = pick.asset
    print(row, name, dict(pick.outputs), pick.why, live["speed"])
    with cdb.watch("tables", lambda snapshot: print(len(snapshot)), poll_s=None) as watch:
        print(watch["locomotion"].query(facts).assets)
    with cdb.link("game") as link:
        link.watch(live, "guard")
        link.picked(moves, "guard", row)


main()
