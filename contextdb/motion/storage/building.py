"""Build the databases of a project from its clips: only what changed is computed, the rest comes from the cache.

    clip files ─► features of each, or the cache ─► one normalisation for all databases of a feature schema ─► MotionDatabase

With the cache a build gives bit for bit what it gives without. A saved database that holds the digest of its inputs is up to date.
An edge: this touches the disk.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from contextdb.cells.arguments import require_kind, require_many, require_mapping, require_path, require_text
from contextdb.disk import real_path
from contextdb.disk.boundary import inside
from contextdb.disk.engines import Engines, here
from contextdb.errors import ArtefactError, Fault, FileError, MotionError, Place, in_quotes, plural, some
from contextdb.motion.clips.doubts import ClipFinding, doubts
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.joint.database import joint_faults
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage import stored
from contextdb.motion.storage.build_inputs import Assets, Faults, Inputs, Tolerates
from contextdb.motion.storage.clip_files import Extracted, named_takes
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.motion.storage.extracting import Progress, extract_all
from contextdb.motion.storage.stored import FeatureCache, file_name

CACHE_FOLDER = ".contextdb-cache"
SAVED_SUFFIX = ".motion.safetensors"
MOST_BONES = 4
"""So many bones are named in a warning."""


@dataclass(frozen=True, eq=False)
class Built:
    """A database and how it came about."""

    database: MotionDatabase
    digest: str
    """Of all that it was made of; empty for a schema with functions, of which that cannot be reported."""
    computed: tuple[str, ...]
    cached: tuple[str, ...]
    """`computed`, `cached`: the clips whose features were computed, and those whose features came from the cache."""
    markup_faults: tuple[Fault, ...] = ()
    """What of its markup does nothing; see `Markup.faults_for`."""
    mirror_faults: tuple[Fault, ...] = ()
    """That its mirrored poses do not fit the rig, whose two sides differ."""
    scale_faults: tuple[Fault, ...] = ()
    """Which channels of its features vary so little that their scale is a floor; see `Normalisation.raised`."""
    doubts: tuple[ClipFinding, ...] = ()
    """What is doubtful about its clips, such as their unit; see `contextdb.motion.clips.doubts`. None stops a build."""


def build(
    config: MotionConfig,
    folder: str | PathLike[str],
    assets: Assets | None = None,
    progress: Progress | None = None,
    *,
    names: Collection[str] | None = None,
    cache: str | PathLike[str] | None = CACHE_FOLDER,
) -> dict[str, MotionDatabase]:
    """Build the databases of a project; those of one feature schema share a normalisation.

    Parameters
    ----------
    config : MotionConfig
    folder : path
        That of contextdb.toml, where the paths of the settings begin.
    assets : mapping of str to collection of str, optional
        For a table's name the assets in it (`CompiledTable.leaves`: without paths): a database of that table holds the clips of
        these alone. Default: all clips.
    progress : function of (done, total, clip name), optional
    names : collection of str, optional
        Which databases to give. Default: all.
    cache : path, optional
        The folder of the cache; a relative one lies in `folder`. None: nothing is stored.

    Raises
    ------
    MotionError, FileError
        With every fault of all clips and of all markup.
    ContextError
        An argument of another type.
    """
    built = build_all(config, folder, assets, progress, names=names, cache=cache)
    return {name: each.database for name, each in built.items()}


def build_all(
    config: MotionConfig,
    folder: str | PathLike[str],
    assets: Assets | None = None,
    progress: Progress | None = None,
    *,
    names: Collection[str] | None = None,
    cache: str | PathLike[str] | None = CACHE_FOLDER,
    tolerates: Tolerates | None = None,
    engines: Engines = here,
) -> dict[str, Built]:
    """Build as `build` does, and tell of each database what it was made of.

    `engines` says where features are worked out; the databases are the same wherever it is.

    `tolerates` is called with the name of a database and what is wrong with it or with one of its clips. Where it says True the
    build goes on without. Of the databases of one schema, which share a normalisation, those that are not among `names` take part.
    Raises what `build` raises.
    """
    root = checked(config, folder, assets, names)
    feature_cache = None if cache is None else FeatureCache(_cache_folder(root, require_path(cache, "cache")))
    faults, built = Faults(tolerates), {}
    inputs = Inputs.of(config, root, assets or {}, names, faults)
    extracted = extract_all(inputs.files, feature_cache, progress, faults, engines)
    faults.tell()
    had_clips = {name: bool(files) for name, files in inputs.files.items()}
    inputs = replace(inputs, files={name: [each.file for each in parts] for name, parts in extracted.items()})
    digests = inputs.digests({name: [each.keys for each in parts] for name, parts in extracted.items()})
    shared = {schema: _shared_normalisation(config, schema, extracted) for schema in inputs.schemas}
    for name in inputs.wanted:
        if had_clips[name] and not extracted[name]:
            continue  # nothing is left of it
        with faults.of(name):
            built[name] = _built(inputs, name, extracted[name], shared, digests[name])
    faults.tell()
    if feature_cache is not None:
        _prune(feature_cache, config, extracted)
    return built


def open_or_build(
    config: MotionConfig,
    folder: str | PathLike[str],
    assets: Assets | None = None,
    progress: Progress | None = None,
    *,
    names: Collection[str] | None = None,
    saved: str | PathLike[str] | None = None,
    cache: str | PathLike[str] | None = CACHE_FOLDER,
    tolerates: Tolerates | None = None,
) -> dict[str, MotionDatabase]:
    """Open the saved databases that are up to date, and build the others in memory.

    Parameters
    ----------
    saved : path, optional
        Where `contextdb motion build` has put them; a relative one lies in `folder`. Default: `folder`.
    config, folder, assets, progress, names, cache, tolerates
        As for `build_all`. All clips are read, as their contents say whether a saved database is up to date. What is tolerated is
        told of databases that have to be built alone.

    Raises
    ------
    MotionError, FileError
        As `build`. A saved database that cannot be used is built anew.
    """
    root = checked(config, folder, assets, names)
    opened = _opened(config, root, root / (require_path(saved, "saved") if saved else ""), assets or {}, names)
    missing = [name for name, database in opened.items() if database is None]
    built = build_all(config, root, assets, progress, names=missing, cache=cache, tolerates=tolerates) if missing else {}
    databases = {
        name: built[name].database if database is None and name in built else database for name, database in opened.items()
    }
    return {name: database for name, database in databases.items() if database is not None}


def _opened(
    config: MotionConfig, root: Path, saved: Path, assets: Assets, names: Collection[str] | None
) -> dict[str, MotionDatabase | None]:
    """The saved databases that are up to date, None for one that is not or of which something is wrong."""
    faults = Faults(lambda name, error: True)
    wanted = config.databases if names is None else [config.database(name).name for name in names]
    inputs = Inputs.of(config, root, assets, wanted, faults)
    keys = inputs.keys(faults)
    whole = {name for name, files in inputs.files.items() if len(keys[name]) == len(files)}
    digests = inputs.digests(keys) if whole == set(inputs.files) else {}
    return {name: _open(saved_path(saved, name), digests.get(name, "")) for name in config.databases if name in wanted}


def _cache_folder(root: Path, cache: Path) -> Path:
    """The folder of a cache: our own in a project is no link, while another that somebody names may be one."""
    return root / cache if cache == Path(CACHE_FOLDER) else real_path(root / cache)


def saved_path(folder: Path, name: str) -> Path:
    """Where a database of a name is saved. Raises ContextError for what is no path and no name, FileError where a link there leads
    out of the folder."""
    place = require_path(folder, "folder")
    return inside(place / file_name(require_text(name, "name"), SAVED_SUFFIX), place)


def checked(config: object, folder: object, assets: object, names: object) -> Path:
    """The folder, after a look at what was given with it."""
    require_kind(config, MotionConfig, "config", "a MotionConfig")
    if assets is not None:
        require_mapping(assets, "assets", "a mapping of tables to assets")
    for name in () if names is None else require_many(names, "names", "a list of databases"):
        require_text(name, "one of names")
    return require_path(folder, "folder")


def _open(path: Path, digest: str) -> MotionDatabase | None:
    try:
        return stored.open_database(path) if digest and stored.inputs_of(path) == digest else None
    except (ArtefactError, FileError):
        return None


# ---- steps of a build


def _shared_normalisation(config: MotionConfig, schema: str, extracted: Mapping[str, list[Extracted]]) -> Normalisation:
    members = [name for name in extracted if config.databases[name].features == schema]
    blocks = [part.features for name in members for each in extracted[name] for part in each.parts]
    return Normalisation.of(blocks, config.features[schema])


def _built(inputs: Inputs, name: str, extracted: list[Extracted], shared: Mapping[str, Normalisation], digest: str) -> Built:
    settings, markup = inputs.config.databases[name], inputs.markups.get(name)
    database = MotionDatabase.from_parts(
        [part for each in extracted for part in each.parts],
        inputs.config.features[settings.features],
        normalisation=shared[settings.features],
        markup=markup,
        biases=Biases(settings.base_bias, settings.looping_bias, settings.continuing_bias),
        end_s=settings.end_s,
    )
    lengths = (database.stops - database.starts).tolist()
    if settings.roles and (faults := list(joint_faults(database.assets, lengths, settings.roles))):
        where = f"[databases.{name}]"
        raise MotionError(*(replace(fault, found=f"{where} {fault.found}", place=Place(inputs.config.file)) for fault in faults))
    return Built(
        database.with_weights(settings.weights) if settings.weights else database,
        digest,
        tuple(each.file.asset for each in extracted if each.is_computed),
        tuple(each.file.asset for each in extracted if not each.is_computed),
        () if markup is None else tuple(_markup_faults(inputs, markup, settings, database)),
        tuple(_mirror_faults(name, extracted)),
        tuple(_scale_faults(settings.features, shared[settings.features])),
        tuple(doubts((each.file.asset, str(each.file.path), each.measures) for each in extracted)),
    )


def _mirror_faults(name: str, extracted: Sequence[Extracted]) -> Iterator[Fault]:
    """One fault for all clips of a database whose rig has two sides that differ: of the clip in which they do most."""
    uneven = [each for each in extracted if each.unevenness]
    if uneven:
        worst = max(uneven, key=lambda each: max(each.unevenness.values()))
        bones = ", ".join(f"{in_quotes(bone)} by {metres:.3f} m" for bone, metres in list(worst.unevenness.items())[:MOST_BONES])
        more = f" and {len(worst.unevenness) - MOST_BONES} more" if len(worst.unevenness) > MOST_BONES else ""
        differ = f"the two sides of the rig differ in {plural(len(uneven), 'clip')}, most in {in_quotes(worst.file.asset)}"
        so = "So far off are mirrored rotations that are played on the rig; searches are exact."
        accepted = "a rig with equal sides, mirror = false, or to leave it where so little cannot be seen"
        yield Fault(f"[databases.{name}] mirror: {differ}: {bones}{more}. {so}", accepted, rule="uneven-sides")


def _scale_faults(schema: str, normalisation: Normalisation) -> Iterator[Fault]:
    """One fault for each group of channels whose scale is a floor."""
    for each in normalisation.raised:
        vary = (
            f"{some(each.channels)} {'varies' if len(each.channels) == 1 else 'vary'} by {each.spread:.2g} {each.unit} in all clips"
        )
        so = "as a smaller scale would make it most of every cost. Clips that vary more, or weight = 0, change that"
        yield Fault(f"[features.{schema}] {vary}: the scale is {each.floor:g}, {so}.")


def _markup_faults(inputs: Inputs, markup: Markup, settings: DatabaseSettings, database: MotionDatabase) -> list[Fault]:
    """What of a markup does nothing: for no clip of the databases that share it, or for no frame of this one's."""
    sharing = [each for each in inputs.config.databases.values() if each.markup == settings.markup]
    known = {name for each in sharing for name, _, _ in named_takes(each, inputs.root, inputs.config.file)}
    rate = inputs.config.features[settings.features].rate
    lengths = (database.stops - database.starts).tolist()
    durations_s = {asset: max(0, length - 1) / rate for asset, length in zip(database.assets, lengths, strict=True)}
    return markup.faults_for(known, durations_s, rate=rate)


def _prune(cache: FeatureCache, config: MotionConfig, extracted: Mapping[str, list[Extracted]]) -> None:
    """Forget clips that changed or are gone."""
    for name, parts in extracted.items():
        cache.prune(name, {key for each in parts for key in each.keys})
    cache.prune_databases(config.databases)
