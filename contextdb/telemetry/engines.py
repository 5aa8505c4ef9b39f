"""Files worked out on Dask: on a local cluster, or on a scheduler's workers.

Each file's result comes once, in any order; or the files that were not finished are named, and nothing is left out in silence.
"""

from __future__ import annotations

import logging
import pickle
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, TypeVar

from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, plural

Engine = Literal["local", "dask"]
ENGINES: tuple[Engine, ...] = ("local", "dask")
RETRIES = 3
"""How often a file is tried again when it is lost for another reason than a dead worker."""
What = TypeVar("What")
Result = TypeVar("Result")


class EngineError(ContextDBError):
    """Dask is missing, cannot be reached, or did not finish some files."""


def with_dask(
    work: Callable[[What, Path], Result], what: What, files: Sequence[Path], scheduler: str | None = None, mend: str = ""
) -> Iterator[tuple[Path, Result]]:
    """Do the work for each file on the workers of a scheduler, or of a cluster of this machine's own; those done first come first.

    `work` is a function of a module, and `what` can be pickled; `mend` says what to do about files that were not finished. Raises
    EngineError where Dask is not installed, the scheduler does not answer, or files were not finished however often they were
    tried.
    """
    distributed = _distributed()
    with _client(distributed, scheduler) as client:
        # A task of its own: when the worker that holds it dies, the scheduler makes it again.
        job = client.submit(bytes, pickle.dumps((work, what)), pure=False)
        tasks = {client.submit(_run, job, str(path), retries=RETRIES, pure=False): path for path in files}
        lost: dict[Path, str] = {}
        for task in distributed.as_completed(tasks):
            try:
                result = task.result()  # waits again where the worker that held it has died since
            except Exception as error:  # whatever happened on a worker: the file is named, and the others go on
                lost[tasks[task]] = str(error) or type(error).__name__
                continue
            yield tasks[task], result
            task.release()
        if lost:
            raise _unfinished(lost, mend)


def _run(job: bytes, path: str) -> Any:
    work, what = _unpickled(job)
    return work(what, Path(path))


@lru_cache(maxsize=1)
def _unpickled(job: bytes) -> tuple[Callable[[Any, Path], Any], Any]:
    job_and_data: tuple[Callable[[Any, Path], Any], Any] = pickle.loads(job)
    return job_and_data


def _unfinished(lost: dict[Path, str], mend: str) -> EngineError:
    files = sorted(lost)
    named = ", ".join(path_in_quotes(path) for path in files[:20])
    more = f" and {len(files) - 20} more" if len(files) > 20 else ""
    problem = f"{plural(len(files), 'file')} could not be finished: {named}{more}. The first: {lost[files[0]].splitlines()[0]}"
    return EngineError(Fault(problem, "", mend))


def _client(distributed: Any, scheduler: str | None) -> Any:
    try:
        if scheduler is None:
            quiet = logging.CRITICAL  # what is lost is reported at the end, by its name
            return distributed.Client(processes=True, threads_per_worker=1, dashboard_address=None, silence_logs=quiet)
        return distributed.Client(scheduler, timeout="10s")
    except KeyboardInterrupt:
        _forget_half_made(distributed)
        raise
    except (OSError, ValueError) as error:
        problem = f"the Dask scheduler {scheduler or 'of this machine'} does not answer: {error}."
        raise EngineError(Fault(problem, "an address such as tcp://10.0.0.5:8786")) from None


def _forget_half_made(distributed: Any) -> None:
    """Leave a cluster that was interrupted while it was made to its workers, which end with this process.

    Closing it at exit, as Dask would, fails with a traceback where its parts are still being made.
    """
    import atexit

    atexit.unregister(distributed.deploy.spec.close_clusters)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise EngineError(Fault("Dask is not installed.", "", 'to install it: pip install "contextdb[dask]"')) from None
    return distributed
