"""Compiles the C programs of the tests with every compiler that is there, under its sanitizers where it has them."""

import contextlib
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest
from strategies import IS_FULL

PROGRAMS = Path(__file__).parent / "c_programs"
BUILT = Path(__file__).parent.parent / ".pytest_cache" / "c_programs"
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Wsign-conversion", "-Wcast-qual", "-Werror"]
SANITIZED = ["-O1" if IS_FULL else "-O0", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
C = ["-xc", "-std=c99", *STRICT]
CXX = ["-xc++", "-std=c++11", *STRICT]


@cache
def c_compiler() -> str | None:
    """The C compiler: $CC, else the first one that is found."""
    return next((path for name in (os.environ.get("CC", "cc"), "gcc", "clang") if (path := shutil.which(name))), None)


@cache
def cxx_compiler() -> str | None:
    """The C++ compiler: $CXX, else the first one that is found."""
    return next((path for name in (os.environ.get("CXX", "c++"), "g++", "clang++") if (path := shutil.which(name))), None)


@cache
def all_compilers() -> list[tuple[str, ...]]:
    """The commands of all C compilers that are there; zig as a program, or as PyPI's package."""
    found = [(path,) for name in ("gcc", "clang") if (path := shutil.which(name))]
    if zig := shutil.which("zig"):
        return [*found, (zig, "cc")]
    has_package = subprocess.run([sys.executable, "-m", "ziglang", "version"], capture_output=True).returncode == 0
    return [*found, (sys.executable, "-m", "ziglang", "cc")] if has_package else found


def compiler_for(options: list[str]) -> str:
    """The compiler for a language; the test is skipped where there is none."""
    found = c_compiler() if options[0] == "-xc" else cxx_compiler()
    if found is None:
        pytest.skip(f"no compiler for {options[0].removeprefix('-x')} was found")
    return found


def variants(*levels: Sequence[str]) -> list[tuple[str, ...]]:
    """All compilers with all of these options; every day each compiler with one of them."""
    compilers = all_compilers()
    if IS_FULL:
        return [(*compiler, *level) for compiler in compilers for level in levels]
    return [(*compiler, *levels[number % len(levels)]) for number, compiler in enumerate(compilers)]


@cache
def sanitizers(*compiler: str) -> tuple[str, ...]:
    """The options for sanitizers, where a program that was compiled with them runs."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder, "empty.c"), Path(folder, "empty.exe")
        source.write_text("int main(void) { return 0; }\n", encoding="ascii")
        done = subprocess.run([*compiler, *SANITIZED, str(source), "-o", str(program)], capture_output=True)
        runs = done.returncode == 0 and subprocess.run([str(program)], capture_output=True).returncode == 0
        return tuple(SANITIZED) if runs else ()


def built(source: Path, program: Path, options: list[str], *more: str) -> Path:
    """Compile one source, with the header beside the program, by the compiler for its language."""
    return compiled([compiler_for(options), *options, *more], source, program, program.parent)


def compiled(command: Sequence[str], source: Path, program: Path, headers: Path, *libraries: str) -> Path:
    """Compile one source with the headers of a folder; no warning is let pass.

    A program is compiled once: it is kept for the other workers and the next runs, under a hash of all that it is made of.
    """
    compiler = shutil.which(command[0]) or command[0]
    made_of = [*command, *libraries, str(Path(compiler).stat().st_mtime_ns)]
    kept = BUILT / _hash(made_of, [source, *sorted(headers.glob("*.h"))])
    with _alone(kept.with_suffix(".lock")):
        if not kept.exists():
            _compile([*command, f"-I{headers}", str(source), *libraries, "-o", str(program)])
            beside = kept.with_suffix(f".{os.getpid()}")
            shutil.copy2(program, beside)
            os.replace(beside, kept)
    shutil.copy2(kept, program)
    return program


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Wait while another worker compiles the same."""
    BUILT.mkdir(parents=True, exist_ok=True)
    with lock.open("w") as file:
        if os.name != "nt":
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _compile(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode or done.stderr:
        pytest.fail(f"{' '.join(command)}\n{done.stderr}", pytrace=False)


def _hash(words: list[str], files: list[Path]) -> str:
    parts = [*(word.encode() for word in words), *(part for file in files for part in (file.name.encode(), file.read_bytes()))]
    return hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in parts)).hexdigest()


def ran(program: Path, *arguments: str | Path, cwd: Path | None = None) -> str:
    """What a program prints; it must end well, without a word from a sanitizer."""
    done = subprocess.run([str(program), *map(str, arguments)], capture_output=True, encoding="utf-8", cwd=cwd)
    if done.returncode or done.stderr:
        pytest.fail(f"{program.name} ended with {done.returncode}\n{done.stdout[-2000:]}{done.stderr}", pytrace=False)
    return done.stdout
