"""Damage whole files at random and read them: `make fuzz`, or `python tests/fuzz.py --seconds 60 --seed 1 --reader csv`.

Each input is read in a process of its own kind, so that one that ends the process, or never ends, is found too. What is found is
written to tests/corpus/READER/, where `make test` reads it from then on. The same seed tries the same inputs in the same order.
"""

import argparse
import hashlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

try:
    import resource
except ImportError:  # Windows
    resource = None

TESTS = Path(__file__).resolve().parent
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

CORPUS = TESTS / "corpus"
BATCH = 100
SLOW_CPU_S = 2.0
"""An input of a few kilobytes that takes longer to read is a find."""
HANG_CPU_S, HANG_S = 60.0, 1200.0
"""An input that takes more is stopped: by what it works, and where it only waits, by the clock."""
TOKENS = [
    *b"\0 \n \r\n , \" ' ( ) [ ] { } < > ; : = | ~ . .. - + * / \\ % # @".split(b" "),
    *b"Any not and or in 1e999 -0 nan inf 170,20 9223372036854775808 ]]> <!-- null true".split(),
    *(b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\xe2\x80\xae"),
    b" " * 100,
    b"(" * 300,
    b"9" * 400,
    b'"' * 51,
]


def mutated(raw: bytes, others: Sequence[bytes], chance: random.Random) -> bytes:
    """A file with a few places damaged."""
    data = bytearray(raw)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        at = chance.randrange(len(data) + 1)
        length = chance.choice((1, 1, 2, 8, 40))
        match chance.randrange(8):
            case 0 if at < len(data):
                data[at] ^= 1 << chance.randrange(8)
            case 1 if at < len(data):
                data[at] = chance.choice((0, 1, 127, 128, 255, chance.randrange(256)))
            case 2:
                del data[at : at + length]
            case 3:
                data[at:at] = chance.choice(TOKENS)
            case 4:
                data[at : at + length] = chance.choice(TOKENS)
            case 5:
                start = chance.randrange(len(data) + 1)
                data[at:at] = data[start : start + chance.choice((1, 10, 100, 1000))]
            case 6 if chance.random() < 0.2:
                del data[at:]
            case _:
                other = chance.choice(others)
                start = chance.randrange(len(other) + 1)
                data[at : at + length] = other[start : start + length]
    return bytes(data)


def input_of(reader: str, seed: int) -> bytes:
    """The input that a seed means."""
    from fuzz_readers import examples

    chance = random.Random(f"{reader} {seed}")
    whole = [*examples(reader), *(path.read_bytes() for path in sorted((CORPUS / reader).glob("*")))]
    return mutated(chance.choice(whole), whole, chance)


def child(reader: str, first: int, progress: Path) -> None:
    """Read a batch, writing before each input which it is, after it how long it took and what was wrong, if anything."""
    from fuzz_readers import read_bytes

    with progress.open("w", encoding="utf-8", buffering=1) as lines:
        for seed in range(first, first + BATCH):
            raw = input_of(reader, seed)
            lines.write(f"{seed} ")
            if hasattr(signal, "setitimer"):
                signal.setitimer(signal.ITIMER_PROF, HANG_CPU_S)
            start, why = time.process_time(), ""
            try:
                read_bytes(reader, raw)
            except Exception as error:
                frame = traceback.extract_tb(error.__traceback__)[-1]
                why = f"{type(error).__name__} in {Path(frame.filename).name}:{frame.lineno}"
            taken = time.process_time() - start
            is_slow = taken > SLOW_CPU_S and seed != first  # the first one loads the reader
            lines.write(f"{taken:.3f} {why or (f'slow: {taken:.0f} s of CPU' if is_slow else '')}\n")
        if resource is not None:
            unit = 1 if sys.platform == "darwin" else 1024
            lines.write(f"peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6:.0f}\n")


@dataclass
class Batch:
    """What a batch came to."""

    n_read: int
    finds: list[tuple[int, str]]
    """Seeds and what was wrong."""
    slowest_s: float
    """Of CPU, without the first, which loads the reader."""
    peak_mb: int


def batch(reader: str, first: int) -> Batch:
    """Run a batch in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        progress = Path(folder) / "progress"
        command = [sys.executable, __file__, "--child", reader, str(first), str(progress)]
        # What a killed process leaves in its temporary folder goes with this one.
        end = how_it_ended(command, progress, {**os.environ, "TMPDIR": folder})
        lines = [line.split(" ", 2) for line in progress.read_text("utf-8").splitlines()]
    peak = next((int(parts[1]) for parts in lines if parts[0] == "peak"), 0)
    inputs = [parts for parts in lines if parts[0] != "peak"]
    finds = [(int(parts[0]), parts[2]) for parts in inputs if len(parts) > 2 and parts[2]]
    if end:
        finds.append((int(inputs[-1][0]) if inputs else first, end))
    slowest = max((float(parts[1]) for parts in inputs[1:] if len(parts) > 2), default=0.0)
    return Batch(len(inputs), finds, slowest, peak)


def how_it_ended(command: Sequence[str], progress: Path, environment: Mapping[str, str] | None = None) -> str:
    """Run a batch to its end, or until it goes no further for HANG_S; nothing where all was read."""
    process, size = subprocess.Popen(command, stderr=subprocess.DEVNULL, env=environment), -1
    progress.touch()
    while (now := progress.stat().st_size) != size:
        size = now
        try:
            code = process.wait(HANG_S)
        except subprocess.TimeoutExpired:
            continue  # a busy machine may take so long for a batch
        if hasattr(signal, "SIGPROF") and code == -signal.SIGPROF:
            return f"no answer after {HANG_CPU_S:.0f} s of CPU"
        return f"the process ended with {code}" if code else ""
    process.kill()
    process.wait()
    return f"no answer after {HANG_S:.0f} s"


def keep(reader: str, seed: int) -> Path:
    """Write an input to the corpus."""
    raw = input_of(reader, seed)
    path = CORPUS / reader / hashlib.blake2b(raw, digest_size=6).hexdigest()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(raw)
    return path


def main() -> int:
    """Go round the readers until the time is up; exits with 1 where anything was found."""
    from fuzz_readers import READERS

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, help="default: a fresh one, which is printed")
    parser.add_argument("--reader", action="append", choices=sorted(READERS))
    options = parser.parse_args()
    first = random.SystemRandom().randrange(10**9) if options.seed is None else options.seed
    readers = options.reader or list(READERS)
    print(f"seed {first}, {options.seconds:.0f} s, {', '.join(readers)}")
    until, causes = time.monotonic() + options.seconds, {}
    batches: dict[str, list[Batch]] = {reader: [] for reader in readers}
    while time.monotonic() < until:  # every reader as often as the others: a round is not cut off
        for reader in readers:
            one = batch(reader, first)
            batches[reader].append(one)
            for seed, why in one.finds:
                if (reader, why) not in causes:
                    causes[reader, why] = keep(reader, seed)
                    print(f"{reader}, seed {seed}: {why}; kept as {causes[reader, why].relative_to(TESTS.parent)}", flush=True)
        first += BATCH
    width = max(map(len, readers))
    print(f"{'reader':<{width}}  {'inputs':>8}  slowest, s  peak, MB")
    for reader, own in batches.items():
        n_read, slowest_s, peak_mb = sum(b.n_read for b in own), max(b.slowest_s for b in own), max(b.peak_mb for b in own)
        print(f"{reader:<{width}}  {n_read:8,}  {slowest_s:10.2f}  {peak_mb:8,}")
    print(f"{sum(b.n_read for own in batches.values() for b in own):,} inputs read, {len(causes)} causes found")
    return 1 if causes else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))
    else:
        sys.exit(main())
