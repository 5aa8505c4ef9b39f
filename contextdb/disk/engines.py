"""Work on many files: one after another here, on all cores of this machine, or on Dask.

    work(what, item) ─► result, for each of some items: here · on_cores · with_dask

Each item's result comes once, in any order; or the files that were not finished are named, and nothing is left out in silence. A
worker that dies costs what it was doing, which another one does again. `work` is a function of a module, and `what`, the items and
their results can be pickled.
"""

from __future__ import annotations

import logging
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar

from contextdb.console import announced
from contextdb.errors import ContextDBError, Fault, in_quotes, plural

if TYPE_CHECKING:
    from concurrent.futures import Future

Engine = Literal["local", "dask"]
ENGINES: tuple[Engine, ...] = ("local", "dask")
RETRIES = 3
"""How often an item is tried again when it is lost: on cores with its worker, on Dask for another reason than a dead worker."""
AHEAD = 2
"""So many items a core wait in the queues of its workers."""
What = TypeVar("What")
Item = TypeVar("Item")
Result = TypeVar("Result")


class Engines(Protocol):
    """How items are worked out: each result with the number of its item. `is_much` says whether it is worth to start workers."""

    def __call__(
        self,
        work: Callable[[What, Item], Result],
        what: What,
        items: Sequence[Item],
        named: Callable[[Item], str] = ...,
        *,
        is_much: bool = ...,
    ) -> Iterator[tuple[int, Result]]: ...


class EngineError(ContextDBError):
    """Workers cannot be had, or did not finish some files."""


def here(
    work: Callable[[What, Item], Result],
    what: What,
    items: Sequence[Item],
    named: Callable[[Item], str] = str,
    *,
    is_much: bool = False,
) -> Iterator[tuple[int, Result]]:
    """Do the work for each item in this process, in order."""
    for i, item in enumerate(items):
        yield i, work(what, item)


def local(
    work: Callable[[What, Item], Result],
    what: What,
    items: Sequence[Item],
    named: Callable[[Item], str] = str,
    *,
    is_much: bool = False,
) -> Iterator[tuple[int, Result]]:
    """Do the work for each item on this machine: much of it on all cores. Only for a program whose main module may be loaded again,
    as workers do, such as a command."""
    yield from on_cores(work, what, items, named) if is_much and n_cores() > 1 else here(work, what, items, named)


def dask(scheduler: str | None, mend: str) -> Engines:
    """The workers of a scheduler, or of a cluster of this machine's own."""

    def on_workers(
        work: Callable[[What, Item], Result],
        what: What,
        items: Sequence[Item],
        named: Callable[[Item], str] = str,
        *,
        is_much: bool = False,
    ) -> Iterator[tuple[int, Result]]:
        return with_dask(work, what, items, scheduler, mend, named)

    return on_workers


def in_order(worked: Iterable[tuple[int, Result]]) -> Iterator[Result]:
    """Results in the order of their items; those that came too early wait."""
    early: dict[int, Result] = {}
    n = 0
    for i, result in worked:
        early[i] = result
        while n in early:
            yield early.pop(n)
            n += 1


def n_cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# ---- on the cores of this machine


def on_cores(
    work: Callable[[What, Item], Result],
    what: What,
    items: Sequence[Item],
    named: Callable[[Item], str] = str,
    n_processes: int | None = None,
) -> Iterator[tuple[int, Result]]:
    """Do the work for each item on all cores; those done first come first. Raises EngineError, after all others, where items ended
    their workers however often they were tried; and what the work raises.

    Only a few items wait in the queues of workers, and results that nobody has taken yet are few too: memory does not grow with
    the number of items.
    """
    from concurrent.futures.process import BrokenProcessPool

    job, n = pickle.dumps((work, what)), n_processes or n_cores()
    waiting, suspects, lost = list(range(len(items)))[::-1], list[int](), dict[int, str]()
    tries = [0] * len(items)
    while waiting or suspects:
        tasks: dict[Future[Any], int] = {}
        alone = not waiting  # so that who ends its worker does so with nobody beside it
        try:
            yield from _pooled(job, items, suspects if alone else waiting, tasks, 1 if alone else n, 1 if alone else AHEAD)
        except BrokenProcessPool as error:
            for i in tasks.values():
                tries[i] += alone
                if tries[i] < RETRIES:
                    suspects.append(i)
                else:
                    lost[i] = str(error)
    if lost:
        raise _unfinished({named(items[i]): why for i, why in lost.items()}, "to run again, with fewer of them")


def _pooled(
    job: bytes, items: Sequence[Any], waiting: list[int], tasks: dict[Future[Any], int], n_processes: int, ahead: int
) -> Iterator[tuple[int, Any]]:
    """Results of what waits, until nothing does; `tasks` are those that are being worked out when a worker dies."""
    import multiprocessing
    from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait

    before = {*multiprocessing.active_children()}
    context = multiprocessing.get_context("spawn")  # a fork of a process with threads may hang
    pool = ProcessPoolExecutor(min(n_processes, len(waiting)), mp_context=context, initializer=_begin)
    try:
        while waiting or tasks:
            while waiting and len(tasks) < ahead * n_processes:
                tasks[pool.submit(_run, job, items[waiting[-1]])] = waiting[-1]
                waiting.pop()
            for done in wait(tasks, return_when=FIRST_COMPLETED).done:
                result = done.result()
                yield tasks.pop(done), result
    except BaseException:
        for process in {*multiprocessing.active_children()} - before:
            process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """In a worker: whoever started it decides when it ends, and it ends with that process."""
    import multiprocessing

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    announced().__enter__()  # to the end of this process
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)


# ---- on Dask


def with_dask(
    work: Callable[[What, Item], Result],
    what: What,
    items: Sequence[Item],
    scheduler: str | None = None,
    mend: str = "",
    named: Callable[[Item], str] = str,
) -> Iterator[tuple[int, Result]]:
    """Do the work for each item on the workers of a scheduler, or of a cluster of this machine's own; those done first come first.

    `mend` says what to do about files that were not finished. Raises EngineError where Dask is not installed, the scheduler does
    not answer, or files were not finished however often they were tried.
    """
    distributed = _distributed()
    with _client(distributed, scheduler) as client:
        # A task of its own: when the worker that holds it dies, the scheduler makes it again.
        job = client.submit(bytes, pickle.dumps((work, what)), pure=False)
        tasks = {client.submit(_run, job, item, retries=RETRIES, pure=False): i for i, item in enumerate(items)}
        lost: dict[str, str] = {}
        for task in distributed.as_completed(tasks):
            i = tasks.pop(task)
            try:
                result = task.result()  # waits again where the worker that held it has died since
            except Exception as error:  # whatever happened on a worker: the file is named, and the others go on
                lost[named(items[i])] = str(error) or type(error).__name__
                continue
            yield i, result
            task.release()
        if lost:
            raise _unfinished(lost, mend)


def _run(job: bytes, item: Any) -> Any:
    work, what = _unpickled(job)
    return work(what, item)


@lru_cache(maxsize=1)
def _unpickled(job: bytes) -> tuple[Callable[[Any, Any], Any], Any]:
    job_and_data: tuple[Callable[[Any, Any], Any], Any] = pickle.loads(job)
    return job_and_data


def _unfinished(lost: dict[str, str], mend: str) -> EngineError:
    files = sorted(lost)
    listed = ", ".join(in_quotes(file, most=4096) for file in files[:20])
    more = f" and {len(files) - 20} more" if len(files) > 20 else ""
    problem = f"{plural(len(files), 'file')} could not be finished: {listed}{more}. The first: {lost[files[0]].splitlines()[0]}"
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
