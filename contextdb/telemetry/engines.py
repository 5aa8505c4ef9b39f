"""Who observes the files: this process, one after the other, or Dask, on a local cluster or on a scheduler's workers.

Every engine gives each file's part once, in any order, or fails and names the files; none leaves one out.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, plural
from contextdb.telemetry.parts import Part, Plan, observe_file

RETRIES = 3
"""How often a file is tried anew when it is lost for another reason than a dead worker."""


class EngineError(ContextDBError):
    """Dask is not there, cannot be reached, or did not finish some files."""


def serially(plan: Plan, files: Sequence[Path]) -> Iterator[tuple[Path, Part]]:
    """Observe the files one after the other."""
    for path in files:
        yield path, observe_file(plan, path)


def with_dask(plan: Plan, files: Sequence[Path], scheduler: str | None = None) -> Iterator[tuple[Path, Part]]:
    """Observe the files on the workers of a scheduler, or of a cluster of this machine's own; those done first come first.

    Raises
    ------
    EngineError
        Dask is not installed, the scheduler does not answer, or files were not finished however often they were tried.
    """
    distributed = _distributed()
    with _client(distributed, scheduler) as client:
        # A task of its own: when the worker that holds the table dies, the scheduler makes it again.
        table = client.submit(bytes, pickle.dumps(plan), pure=False)
        tasks = {client.submit(_observe, table, str(path), retries=RETRIES, pure=False): path for path in files}
        lost: dict[Path, str] = {}
        for task in distributed.as_completed(tasks):
            try:
                part = task.result()  # waits again where the worker that held it has died since
            except Exception as error:  # whatever happened on a worker: the file is named, and the others go on
                lost[tasks[task]] = str(error) or type(error).__name__
                continue
            yield tasks[task], part
        if lost:
            raise _unfinished(lost)


def _observe(table: bytes, path: str) -> Part:
    return observe_file(_plan(table), path)


@lru_cache(maxsize=1)
def _plan(table: bytes) -> Plan:
    plan: Plan = pickle.loads(table)
    return plan


def _unfinished(lost: dict[Path, str]) -> EngineError:
    files = sorted(lost)
    named = ", ".join(path_in_quotes(path) for path in files[:20])
    more = f" and {len(files) - 20} more" if len(files) > 20 else ""
    found = f"{plural(len(files), 'file')} could not be finished: {named}{more}. The first: {lost[files[0]].splitlines()[0]}"
    return EngineError(Fault(found, "", "to run again with the same resume folder"))


def _client(distributed: Any, scheduler: str | None) -> Any:
    try:
        if scheduler is None:
            return distributed.Client(processes=True, threads_per_worker=1, dashboard_address=None)
        return distributed.Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        found = f"the Dask scheduler {scheduler or 'of this machine'} does not answer: {error}."
        raise EngineError(Fault(found, "an address such as tcp://10.0.0.5:8786")) from None


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        found = "Dask is not installed."
        raise EngineError(Fault(found, "", 'to install it: pip install "contextdb[dask]"')) from None
    return distributed
