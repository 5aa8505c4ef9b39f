"""How fast contextdb answers, beside other engines and beside the bitmask scheme in its simplest forms.

    python benchmarks/query.py                      everything, in about five minutes
    python benchmarks/query.py --quick              a rough look at everything
    python benchmarks/query.py --only single batch  some sections
    python benchmarks/query.py --against PATH       only single queries, beside another checkout of contextdb
    python benchmarks/query.py --json FILE          the same figures for programs

Every engine's answers are compared with a reading of every cell before anything is timed. See `benchmarks/timing.py` for how
times are taken. A peer that is not installed is named and left out: `pip install "contextdb[bench]"` brings them all.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import against, sections, timing

SECTIONS: dict[str, Callable[[timing.Effort, bool], dict[str, Any]]] = {
    "single": sections.single,
    "batch": sections.batch,
    "bounds": sections.bounds,
    "recompile": sections.recompile,
    "startup": sections.startup,
}


def main() -> None:
    """Run the sections asked for, print them, and write them as JSON when that is asked for too."""
    parser = argparse.ArgumentParser(description="Measure contextdb beside other engines.")
    parser.add_argument("--quick", action="store_true", help="fewer calls, for a rough look")
    parser.add_argument("--only", nargs="+", choices=list(SECTIONS), default=list(SECTIONS), help="sections to run")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures to a file")
    parser.add_argument("--against", type=Path, metavar="PATH", help="compare with the contextdb of another checkout instead")
    options = parser.parse_args()
    report: dict[str, Any] = {"format": 1, "machine": timing.machine(), "versions": timing.versions()}
    print(" · ".join(f"{key} {value}" for key, value in (report["machine"] | report["versions"]).items()))
    effort = timing.QUICK if options.quick else timing.FULL
    if options.against:
        report["against"] = against.measure(options.against, effort)
    for name in [] if options.against else options.only:
        report[name] = SECTIONS[name](effort, options.quick)
    report["load_at_end"] = timing.machine()["load"]
    print(f"\nload at the end {report['load_at_end']}")
    if options.json:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
