"""How many examples a property test draws, and which.

Every day: a few, and the same ones on every run; of what runs an editor, also half of the examples that are written down. With
EXAMPLES=full, as `.ci/run` does: all of them, from a seed that is new on every run and stands at the top of its output. What fails
then is printed, and kept in .hypothesis/, where the next full run tries it first; write it over the test as `@example(...)`, and
every run tries it. EXAMPLES=thorough draws 2,000 of each.

Files of the tests are in memory where the machine has such a folder with room; TMPDIR=... says another place.
"""

import atexit
import gc
import os
import random
import shutil
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from hypothesis import HealthCheck, settings
from hypothesis.database import DirectoryBasedExampleDatabase

ROOT = Path(__file__).parent.parent
SIZES = {"few": 10, "full": 40, "thorough": 2000}
SIZE = os.environ.get("EXAMPLES") or "few"
# The workers of pytest-xdist are started with this environment: all of them draw from one seed.
SEED = os.environ.setdefault("EXAMPLES_SEED", str(random.randrange(10**9)))
OF_CHANCE = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
"""Checks of how examples are drawn. They fail now and then for one seed or a few examples, though the code is right."""

if providers := sys.modules.get("hypothesis.internal.conjecture.providers"):
    # Hypothesis draws constants of the modules that happen to be loaded; then one seed would draw other examples in each worker.
    vars(providers)["is_local_module_file"] = lambda path: False

MEMORY, ROOM = Path("/dev/shm"), 4 << 30
"""Where files are kept in memory on Linux, and how many bytes must be free there."""


def has_room(folder: Path) -> bool:
    """Whether the tests can write their files there, and start the programs that they compile."""
    if sys.platform != "linux" or not os.access(folder, os.W_OK):
        return False
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize >= ROOM and not disk.f_flag & os.ST_NOEXEC


if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what runs behind it so, and the processes that a test starts and interrupts would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)

if "TMPDIR" not in os.environ and has_room(MEMORY):
    # Each save waits for the disk, for some milliseconds, and there are thousands of saves. The workers and all commands do so too.
    os.environ["TMPDIR"] = str(MEMORY)
    tempfile.tempdir = None

if "PYTEST_XDIST_WORKER" not in os.environ:
    # What tests and their processes make outside `tmp_path` is in one folder, which is removed with all that is left in it.
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
    os.environ["TMPDIR"] = tempfile.tempdir = tempfile.mkdtemp(prefix="t-")
    atexit.register(shutil.rmtree, os.environ["TMPDIR"], ignore_errors=True)

gc.disable()
if SIZE not in SIZES:
    raise pytest.UsageError(f"EXAMPLES={SIZE}: expected one of {', '.join(SIZES)}")
settings.register_profile(
    "few", derandomize=True, deadline=None, database=None, max_examples=SIZES["few"], suppress_health_check=OF_CHANCE
)
for name in ("full", "thorough"):
    settings.register_profile(
        name,
        derandomize=False,
        deadline=None,
        database=DirectoryBasedExampleDatabase(ROOT / ".hypothesis" / "examples"),
        max_examples=SIZES[name],
        print_blob=True,
        suppress_health_check=OF_CHANCE,
    )
settings.load_profile(SIZE)


def _seed(config: pytest.Config) -> str:
    return str(config.getoption("hypothesis_seed") or SEED)


def pytest_report_header(config: pytest.Config) -> str:
    """Which examples are drawn, and how to draw them again."""
    if settings.default.derandomize:
        return "examples: a few, the same ones on every run; EXAMPLES=full draws all of them, from a new seed"
    seed = _seed(config)
    return f"examples: {SIZE}, from seed {seed}; to draw them again: EXAMPLES={SIZE} python -m pytest --hypothesis-seed={seed}"


def seed_test(test: Any, seed: str) -> None:
    """Draw from a seed, as `hypothesis.seed` would; that one also stops failures from being kept."""
    getattr(test, "_hypothesis_state_machine_class", test)._hypothesis_internal_use_seed = seed


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Seed each property test by its own name, so that what it draws does not depend on the tests before it."""
    test = getattr(item, "function", None)
    if hypothesis.is_hypothesis_test(test) and not settings.default.derandomize:
        seed_test(test, f"{_seed(item.config)} {item.nodeid}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Every day every second example of an editor's test that has four and more, unless one is asked for by its name; all pages."""
    if SIZE != "few" or any("[" in word for word in config.args):
        return
    names = [item.nodeid.partition("[")[0] for item in items]
    sizes, numbers = Counter(names), Counter[str]()
    chosen, left_out = [], []
    for item, name in zip(items, names, strict=True):
        numbers[name] += 1
        is_some_of_many = name.startswith("tests/tui/") and "/test_pages.py" not in name and sizes[name] >= 4
        is_chosen = numbers[name] % 2 or not is_some_of_many
        (chosen if is_chosen else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = chosen


def pytest_collection_finish() -> None:
    """What is loaded and collected by now stays: the search for what can be thrown away begins here, and comes less often."""
    gc.freeze()
    gc.enable()
    gc.set_threshold(20_000, 10, 20)
