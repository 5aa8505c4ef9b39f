"""The search of the site: what a newcomer asks is answered in the first three hits, exact titles first, guides before reference."""

import importlib.util
import json
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SITE = ROOT / "docs" / "site"
NODE = shutil.which("node")
QUESTIONS = {
    "is it stable, who uses it, what will break": "deciding#is-it-stable-and-who-uses-it",
    "how do I use it in Unreal at run time": "engines or deciding#which-engines-at-run-time-unreal-unity-godot",
    "Unity? Godot?": "engines or deciding#which-engines-at-run-time-unreal-unity-godot",
    "is it on PyPI": "deciding#what-it-costs",
    "our clips are FBX": "deciding#our-clips-are-fbx",
    "we use Perforce": "deciding#we-use-perforce-or-nothing-but-a-share",
    "does it run on consoles, fixed memory, without an allocator": "deciding#consoles-memory-threads",
    "is it deterministic, for replays and network play": "deciding#is-it-deterministic",
    "how large may a table be": "deciding#how-large-may-a-table-be",
    "how much memory has it at run time": "deciding#consoles-memory-threads",
    "thread-safe": "programmers#threads or engines#threads",
    "why does my animation not play": "designers#why-does-my-animation-not-play",
    "rename a condition": "editor#rows-and-columns",
    "from Excel and back": "recipes#how-do-i-take-a-table-to-excel-and-back",
    "two designers at once": "version-control#two-people-one-table-contextdb-merge",
    "undo after save": "editor#saving",
    "Windows terminal keys": "editor#terminals",
    "does installing need a C compiler": "index#installation",
    "Jupyter": "deciding#notebooks-jupyter-and-dataframes",
    "a DataFrame of the results": "programmers#dataframes",
    "what do I replace in my state machine": "deciding#from-a-state-machine-to-a-table",
    "cost of motion matching compared with Unreal's Pose Search": "deciding#from-unreals-pose-search",
    "is 3 % coverage bad": "deciding#is-3--coverage-bad",
    "where is the cache, how do I clear it": "deciding#where-is-the-cache",
    "VS Code completion and check of CSV": "deciding#our-editors-vs-code-and-others",
}
"""The questions of a newcomer, and a section that answers each."""
ASK = """
const { prepared, rank } = require(process.argv[1]);
const { sections, questions } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const index = prepared(sections);
console.log(JSON.stringify(questions.map((question) => rank(index, question, 6).map((hit) => hit.page + "#" + hit.anchor))));
"""


@cache
def hits(*questions: str) -> list[list[str]]:
    """The first hits of each question."""
    spec = importlib.util.spec_from_file_location("sections", SITE / "sections.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    given = json.dumps({"sections": module.sections(module.pages_in(ROOT / "docs")), "questions": questions})
    done = subprocess.run(
        [str(NODE), "-e", ASK, str(SITE / "rank.js")], input=given, capture_output=True, encoding="utf-8", check=True
    )
    return list(json.loads(done.stdout))


needs_node = pytest.mark.skipif(NODE is None, reason="node runs the search, and is not installed")


@needs_node
@pytest.mark.parametrize("question", QUESTIONS)
def test_a_newcomers_question_is_answered_in_the_first_three_hits(question: str):
    first = hits(*QUESTIONS)[[*QUESTIONS].index(question)]
    wanted = QUESTIONS[question].split(" or ")
    assert any(hit.startswith(each) for hit in first[:3] for each in wanted), first[:3]


@needs_node
def test_an_exact_title_comes_first_and_guides_before_reference():
    (exact,), (tags,) = hits("Why does my animation not play?"), hits("tags")
    assert exact[0] == "designers#why-does-my-animation-not-play"
    assert tags[0] == "designers#tags"
