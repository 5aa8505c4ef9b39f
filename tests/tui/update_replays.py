"""Write what the editor and the debugger show now into their replay files and pages; with names only into those."""

import sys

import debug_replay
from replay import FILES, PAGES, Replay, replayed, updated_page


def main(names: list[str]) -> None:
    """Write, and say what was written."""
    kinds: dict[type[Replay], list] = {Replay: FILES, debug_replay.DebugReplay: debug_replay.FILES}
    for kind, files in kinds.items():
        for path in files:
            before, now = replayed(path, kind) if not names or path.stem in names else ("", "")
            if before != now:
                path.write_text(now, "utf-8")
                print(f"{path.name}: written")
    for path in PAGES:
        before = path.read_text("utf-8")
        if (not names or path.stem in names) and (now := updated_page(before)) != before:
            path.write_text(now, "utf-8")
            print(f"{path.name}: written")


if __name__ == "__main__":
    main(sys.argv[1:])
