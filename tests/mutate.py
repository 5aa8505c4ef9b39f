"""Change an engine at random and see whether its tests fail: `make mutate`, or `python tests/mutate.py --seconds 600 --seed 1`.

A mutation turns a comparison, a sign, an `and`, or a number by one. It is made in a copy of the checkout, where the tests of that
engine run until the first fails; the same seed draws the same mutations. Those that no test notices are listed, to be looked at: a
test is missing, the line is not needed, or the change means the same.
"""

import argparse
import io
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENGINES = {
    "contextdb/core/[!p_]*.h": "test_core.py test_compiled.py test_c_rules.py test_picker.py test_batch.py covering motion",
    "contextdb/bitmask.py": "test_bitmask.py test_compiled.py",
    "contextdb/cells/*.py": "test_cells.py test_facts.py test_compiled.py refused_facts.md refused_compiled.md",
    "contextdb/expressions/*.py": "expressions test_when.py",
    "contextdb/compiled/*.py": "test_compiled.py test_explain.py test_batch.py test_picker.py test_outputs.py test_artefact.py "
    "refused_compiled.md refused_batch.md refused_picker.md refused_outputs.md",
    "contextdb/covering/*.py": "covering",
    "contextdb/edits/*.py": "test_edits.py",
    "contextdb/tables/merging/*.py": "test_merge.py",
    "contextdb/motion/search/*.py": "motion/test_search.py motion/test_search_many.py refused_motion_database.md",
    "contextdb/motion/selection/*.py": "motion",
    "contextdb/motion/output/*.py": "motion",
}
"""Files, and the tests and transcripts that are to notice a change of them."""
PAGE = "test_docs.py::test_a_document_shows_what_its_commands_print[tests/transcripts/{}]"
TURNED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "and": "or", "or": "and"}
TURNED |= {"&&": "||", "||": "&&"}
IN_C = re.compile(
    r'/\*.*?\*/|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|^\s*#.*?$|(?<= )(<=?|>=?|==|!=|&&|\|\||[+-])(?= )|\b(\d+)\b',
    re.DOTALL | re.M,
)
LEAST_S = 60.0
"""The tests may take five times what they take without a change, and so long at least; then the change counts as noticed."""


@dataclass(frozen=True)
class Mutation:
    """A text in a file that becomes another one."""

    path: str
    start: int
    old: str
    new: str
    tests: str

    def __str__(self) -> str:
        line = (ROOT / self.path).read_text("utf-8").count("\n", 0, self.start) + 1
        return f"{self.path}:{line}: {self.old} becomes {self.new}"


def mutations() -> list[Mutation]:
    """All that can be drawn, in the order of files and places."""
    drawn = []
    for pattern, tests in ENGINES.items():
        for path in sorted(ROOT.glob(pattern)):
            text = path.read_text("utf-8")
            places = c_places(text) if path.suffix == ".h" else python_places(text)
            drawn += [Mutation(path.relative_to(ROOT).as_posix(), at, old, turned(old), tests) for at, old in places]
    return drawn


def turned(token: str) -> str:
    return str(int(token) + 1) if token.isdecimal() else TURNED[token]


def c_places(text: str) -> Iterator[tuple[int, str]]:
    for match in IN_C.finditer(text):
        if match[1] or match[2]:
            yield match.start(), match[1] or match[2]


def python_places(text: str) -> Iterator[tuple[int, str]]:
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        is_whole = token.type == tokenize.NUMBER and token.string.isdecimal()
        if is_whole or (token.type in (tokenize.OP, tokenize.NAME) and token.string in TURNED):
            yield starts[token.start[0] - 1] + token.start[1], token.string


def fails(folder: Path, tests: str, most_s: float | None) -> bool:
    """Whether a test fails, or does not end."""
    names = [f"tests/{PAGE.format(name) if name.endswith('.md') else name}" for name in tests.split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--hypothesis-seed=1", *names]
    environment = os.environ | {"PYTHONPATH": str(folder), "TMPDIR": str(folder)}
    try:
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=most_s).returncode != 0
    except subprocess.TimeoutExpired:
        return True


def is_noticed(folder: Path, one: Mutation, most_s: float) -> bool:
    """Whether a test fails with a mutation; a core that does not compile is noticed too."""
    path = folder / one.path
    before = path.read_text("utf-8")
    path.write_text(before[: one.start] + one.new + before[one.start + len(one.old) :], "utf-8")
    try:
        return (path.suffix == ".h" and not builds(folder)) or fails(folder, one.tests, most_s)
    finally:
        path.write_text(before, "utf-8")
        if path.suffix == ".h":
            builds(folder)


def builds(folder: Path) -> bool:
    return subprocess.run([sys.executable, "build_core.py"], cwd=folder, capture_output=True).returncode == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw until the time or the number is reached; exits with 0, as survivors are for people to judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=200)
    options = parser.parse_args(arguments)
    drawn = random.Random(options.seed).sample(mutations(), options.most)
    until, n_noticed, survivors, times = time.monotonic() + options.seconds, 0, [], {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "checkout")
        files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
        for file in files:
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / file, folder / file)
        builds(folder)
        for one in drawn:
            if time.monotonic() > until:
                break
            if one.tests not in times:
                start = time.monotonic()
                if fails(folder, one.tests, None):
                    print(f"the tests of {one.path} fail without any change: {one.tests}")
                    return 1
                times[one.tests] = time.monotonic() - start
            if is_noticed(folder, one, max(LEAST_S, 5 * times[one.tests])):
                n_noticed += 1
            else:
                survivors.append(one)
                print(f"not noticed: {one}", flush=True)
    n = n_noticed + len(survivors)
    print(f"seed {options.seed}: {n_noticed} of {n} mutations were noticed ({n_noticed / max(n, 1):.0%})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
