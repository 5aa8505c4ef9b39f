"""How a build of many clips grows: its time and its memory, on a local cluster of two workers of which one is killed.

    python benchmarks/many_clips.py                   1,500, 3,000 and 6,000 made clips
    python benchmarks/many_clips.py --clips 500 1000

Each build begins without a cache. CPU is that of all processes together. Memory is what a process must have, without pages of
files that the system may drop: of this process over what it had before, and of the largest worker. At the largest size a worker is
killed when a third is done; the database has the same digest as one that is built here from the cache.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

if __package__ in (None, ""):
    sys.path[0] = str(Path(__file__).parent.parent)  # not this folder: its coverage.py is no package of that name

from benchmarks import timing
from contextdb import motion
from contextdb.disk import engines
from contextdb.motion.clips.bvh import write
from contextdb.motion.made.recipes import made_clips
from contextdb.motion.storage.building import Built, build_all

SIZES = (1500, 3000, 6000)
N_WORKERS = 2
SHIFT_CM = 1e-3
"""Clips differ by how far their roots are, so that no two files are equal."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", metavar="N", type=int, nargs="+", default=SIZES)
    sizes = sorted(parser.parse_args().clips)
    from distributed import LocalCluster

    local_cluster: Any = LocalCluster

    print(f"{timing.machine()}\n{timing.versions()}")
    print(f"{'clips':>7}{'frames':>11}{'s':>8}{'ms a clip':>11}{'CPU, s':>9}{'here, MB':>10}{'worker, MB':>12}  killed")
    with tempfile.TemporaryDirectory() as folder:
        config = make(Path(folder), sizes[-1])
        for size in sizes:
            with local_cluster(n_workers=N_WORKERS, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
                measure(config, Path(folder), size, cluster, kills=size == sizes[-1])


def make(folder: Path, n: int) -> motion.MotionConfig:
    """Write so many clips."""
    (folder / "clips").mkdir()
    made = [each.clip for each in made_clips()]
    for i in range(n):
        clip = made[i % len(made)]
        values = clip.values.copy()
        values[:, 0] += SHIFT_CM * i
        (folder / f"clips/{i:06}.bvh").write_text(write(clip.skeleton, clip.frame_time_s, values, 4), encoding="utf-8")
    feet = [{"type": "position", "bone": bone} for bone in ("LeftFoot", "RightFoot")]
    channels = [*feet, {"type": "trajectory", "what": "position", "at": [0.3, 0.6, 1.0]}]
    features = {"all": {"rate": 30.0, "mirror": [["Left*", "Right*"]], "channels": channels}}
    return motion.MotionConfig.from_dict(
        {"features": features, "databases": {"all": {"clips": "clips/*.bvh", "features": "all", "mirror": True, "table": "t"}}}
    )


def measure(config: motion.MotionConfig, folder: Path, n: int, cluster: Any, *, kills: bool) -> None:
    """Build a database of so many clips on the workers, and print what it took."""
    assets = {"t": [f"{i:06}" for i in range(n)]}
    killed: list[int] = []

    def pids() -> list[int]:
        return [worker.pid for worker in list(cluster.workers.values()) if worker.pid]

    def progress(done: int, total: int, name: str) -> None:
        if kills and not killed and done > total / 3:
            killed.append(pids()[0])
            os.kill(killed[0], signal.SIGKILL)

    with used(pids) as use:
        start = time.perf_counter()
        on_workers = engines.dask(cluster.scheduler_address, "to run again")
        built = build_all(config, folder, assets, progress, cache=f"cache-{n}", engines=on_workers)["all"]
        took = time.perf_counter() - start
    frames, cpu_s = built.database.n_frames, sum(use.cpu_s.values())
    counts = f"{n:7,}{frames:11,}{took:8.1f}{1000 * took / n:11.1f}{cpu_s:9.1f}"
    print(f"{counts}{use.here_mb:10.0f}{use.worker_mb:12.0f}  {len(killed)}", flush=True)
    if kills:
        check(built, build_all(config, folder, assets, cache=f"cache-{n}")["all"])


def check(there: Built, here: Built) -> None:
    """Raise AssertionError unless the workers gave what this process gives, from the cache that they left."""
    assert here.computed == ()
    assert there.digest == here.digest
    assert there.database.layout.blocks.tobytes() == here.database.layout.blocks.tobytes()


@dataclass
class Use:
    """The most memory, in MB, of this process over what it had before and of the largest worker; what each process worked."""

    here_mb: float = 0.0
    worker_mb: float = 0.0
    cpu_s: dict[int, float] = field(default_factory=dict)


@contextmanager
def used(pids: Callable[[], list[int]]) -> Iterator[Use]:
    """What this process and some others use meanwhile; one that was killed counts up to its last fifth of a second."""
    use, done, own = Use(), threading.Event(), os.getpid()
    mb, cpu_s = own_mb(own), {pid: worked_s(pid) for pid in (own, *pids())}

    def look() -> None:
        others = pids()
        use.here_mb = max(use.here_mb, own_mb(own) - mb)
        use.worker_mb = max([use.worker_mb, *map(own_mb, others)])
        for pid in (own, *others):
            use.cpu_s[pid] = max(worked_s(pid) - cpu_s.get(pid, 0.0), use.cpu_s.get(pid, 0.0))

    def watch() -> None:
        while not done.wait(0.2):
            look()

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield use
    finally:
        done.set()
        thread.join()
        look()


def worked_s(pid: int) -> float:
    """How long a process has worked, in seconds of CPU; 0 where the system does not say it."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def own_mb(pid: int) -> float:
    """Memory of a process that is no page of a file; 0 where the system does not say it."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text("ascii").splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) for line in lines if line.startswith("RssAnon")) / 1024.0


if __name__ == "__main__":
    main()
