"""What is wrong with the clips, the markup and the settings of a project, all of it at once. An edge: this touches the disk.

Each clip is read and its features are computed as for a build, with its cache; what a build would refuse is an error here, what it
would warn of a warning, and one broken thing hides no other.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from contextdb.disk import matching
from contextdb.errors import ContextDBError, Fault, MotionError, Place, nearest, plural, some
from contextdb.findings import Finding
from contextdb.motion.clips.clip import CENTIMETRE
from contextdb.motion.clips.clip_measures import Measures, measure
from contextdb.motion.clips.doubts import ClipFinding, doubts
from contextdb.motion.clips.source import load_clips
from contextdb.motion.storage import building
from contextdb.motion.storage.build_inputs import Assets, Faults, Inputs, distinct_faults
from contextdb.motion.storage.building import Built
from contextdb.motion.storage.clip_files import ClipFile, read_clip, unmatched
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.extracting import Progress


@dataclass(frozen=True, slots=True)
class MotionFindings:
    """The findings, and of each database how many clips could be used."""

    findings: tuple[Finding, ...]
    n_clips: dict[str, int]


def check_motion(
    config: MotionConfig,
    folder: Path,
    assets: Assets,
    progress: Progress | None = None,
    *,
    cache: str | None = building.CACHE_FOLDER,
) -> MotionFindings:
    """Check the databases of a project; `folder` and `assets` as for `build`."""
    refused: list[Fault] = []

    def takes(name: str, error: ContextDBError) -> bool:
        refused.extend(error.faults)
        return True

    built = building.build_all(config, folder, assets, progress, cache=cache, tolerates=takes)
    files = Inputs.of(config, folder, assets, None, Faults(lambda name, error: True)).files
    findings = [Finding.of(fault) for fault in _in_files(distinct_faults(refused), files)]
    findings += _of_clips(built, _left_out(files, built), config)
    findings += _of_settings(config)
    findings += _of_assets(config, folder, assets)
    return MotionFindings(tuple(findings), {name: len(each.computed) + len(each.cached) for name, each in built.items()})


def check_clips(paths: Sequence[Path], progress: Progress | None = None, metres_per_unit: float = CENTIMETRE) -> MotionFindings:
    """Check clips that no project names yet; those of one rig are compared with each other.

    `metres_per_unit` is what one unit of the files is taken to be.
    """
    findings: list[Finding] = []
    rigs: dict[tuple[str, ...], list[tuple[str, str, Measures]]] = {}
    for i, path in enumerate(paths):
        if progress is not None:
            progress(i, len(paths), path.name)
        try:
            clips = load_clips([path], metres_per_unit=metres_per_unit)
            if not all(clip.n_frames for clip in clips):
                raise MotionError(Fault("the clip has no frame (Frames: 0).", "one frame or more", place=Place(str(path))))
        except ContextDBError as error:
            findings += [Finding.of(fault if fault.place.file else fault.at(Place(str(path)))) for fault in error.faults]
            continue
        for clip in clips:
            rigs.setdefault(clip.skeleton.names, []).append((clip.name, str(path), measure(clip)))
            findings += [Finding("left-out", "info", note, file=str(path), asset=clip.name) for note in clip.notes]
    for measured in rigs.values():
        findings += [
            Finding(doubt.rule, "warning", doubt.message, file=doubt.file, asset=doubt.asset) for doubt in doubts(measured)
        ]
    return MotionFindings(tuple(findings), {"": sum(map(len, rigs.values()))})


def _in_files(faults: Iterable[Fault], files: Mapping[str, list[ClipFile]]) -> Iterator[Fault]:
    """The faults; those at the name of a clip at its file."""
    paths = {file.asset: str(file.path) for listed in files.values() for file in listed}
    for fault in faults:
        path = paths.get(fault.place.file or "")
        yield fault if path is None else replace(fault, place=replace(fault.place, file=path))


def _left_out(files: Mapping[str, list[ClipFile]], built: Mapping[str, Built]) -> Iterator[ClipFinding]:
    """What is doubtful of clips that can be read, but whose features cannot be computed."""
    for name, listed in files.items():
        used = {*built[name].computed, *built[name].cached} if name in built else set()
        yield from doubts(_measured(file for file in listed if file.asset not in used))


def _measured(files: Iterable[ClipFile]) -> Iterator[tuple[str, str, Measures]]:
    for file in files:
        with suppress(ContextDBError):
            clip = read_clip(file)
            if clip.n_frames:
                yield file.asset, str(file.path), measure(clip)


def _of_clips(built: Mapping[str, Built], left_out: Iterable[ClipFinding], config: MotionConfig) -> Iterator[Finding]:
    """What is doubtful of clips; a clip in several databases is reported once."""
    used = (doubt for each in built.values() for doubt in each.doubts)
    for doubt in dict.fromkeys(chain(used, left_out)):
        yield Finding(doubt.rule, "warning", doubt.message, file=doubt.file, asset=doubt.asset)
    for fault in dict.fromkeys(fault for each in built.values() for fault in each.markup_faults):
        yield Finding.of(fault, "warning")
    for fault in dict.fromkeys(fault for each in built.values() for fault in each.mirror_faults):
        yield Finding.of(fault.at(Place(config.file)), "warning")


def _of_settings(config: MotionConfig) -> Iterator[Finding]:
    """Sections that nothing uses."""
    used = {settings.features for settings in config.databases.values()}
    for name in (name for name in config.features if name not in used):
        yield _unused(config, f"[features.{name}] no database compares by it.", name, used, "features")
    for name in (name for name in config.output if name not in config.controllers):
        yield _unused(config, f"[output.{name}] there is no controller of this name.", name, config.controllers, "output")


def _unused(config: MotionConfig, problem: str, name: str, known: Collection[str], section: str) -> Finding:
    names = sorted(known)
    near = nearest(name, names)
    mend = f"[{section}.{near}]" if near else ""
    return Finding.of(Fault(problem, some(names) or "none: there are none", mend, Place(config.file), "unused-section"), "warning")


def _of_assets(config: MotionConfig, folder: Path, assets: Assets) -> Iterator[Finding]:
    """Rows without a clip, and clips without a row."""
    with_files = [settings for settings in config.databases.values() if _has_pattern(folder, settings.clips)]
    missing, unlisted = unmatched(with_files, folder, {table: list(names) for table, names in assets.items()})
    for table, names in missing.items():
        problem = f"no database has a clip of {plural(len(names), 'asset')}: {some(names)}."
        yield Finding("no-clip", "warning", problem, table=table)
    if unlisted:
        problem = f"no table has a row for {plural(len(unlisted), 'clip')}: {some(unlisted)}."
        yield Finding("no-row", "info", problem, file=config.file)


def _has_pattern(folder: Path, clips: str) -> bool:
    """Whether a pattern can be looked for; one that cannot is refused where files are listed."""
    try:
        matching(folder, clips)
    except (ValueError, NotImplementedError):
        return False
    return True
