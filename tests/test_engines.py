"""The examples for game engines give the rows, the picks and the digests of Python, each in the engine where it is installed."""

from __future__ import annotations

import json
import random
import re
import shutil
import subprocess
from datetime import date, timedelta
from pathlib import Path

import c_compilers
import numpy as np
import pytest
from c_compilers import CXX, PROGRAMS, C, built, compiler_for, ran, sanitizers

import contextdb as cdb
from contextdb import motion
from contextdb.cli import main as run_contextdb
from contextdb.commands.compile_command import c_motion_header
from contextdb.compiled.c_header import c_header_of, c_link_of
from contextdb.compiled.engine_facts import csharp_of, godot_of, unreal_of
from contextdb.motion.made.body import made_skeleton

EXAMPLES = Path(__file__).parent.parent / "examples"
LIBRARY = ["-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-O0"]
SCHEMA: dict[str, dict[str, object]] = {
    "gait": {"type": "enum", "values": ["Idle", "Walk", "Run"]},
    "speed": {"type": "number"},
    "heading": {"type": "angle"},
    "wounds": {"type": "int"},
    "day": {"type": "date"},
    "mood": {"type": "text"},
    "tags": {"type": "tags", "values": ["Move.Run", "InAir", "Größe"]},
    "heard": {"type": "tags"},
    "is_hurt": {"type": "bool", "expr": "wounds > 2"},
}
N_MOMENTS = 1000
PAGE = (EXAMPLES.parent / "docs" / "engines.md").read_text(encoding="utf-8")
FRAME = """#define CDB_FILES
#include <stdio.h>
#include "contextdb_motion.h"

static int n_drawn;

static void my_ground(void *user, double x, double z, double *ground)
{
    (void)user, (void)x, (void)z;
    ground[0] = ground[1] = ground[2] = 0.0;
}

static void draw(const double *root, const double *rotations, const double *translations)
{
    n_drawn += root[1] > -1.0 && rotations && translations;
}

int main(void)
{
    size_t size;
    void *bytes = cdb_read_file("game.motion", &size, NULL);
    double x = 0.0, z = 0.0, heading = 0.0, dt = 1.0 / 60.0;
    int gait, tick;
OPENING
    gait = cdb_condition_number(live->schema, "gait");
    cdb_set_text(live, cdb_condition_number(live->schema, "style"), "normal");
    if (why) return puts(why), 1;
    for (tick = 0, z = 1.3; tick < 60; tick++) {
FRAME
    }
    printf("%s\\n%d\\n", cdbm_asset(&player, &pose.decision.playing), n_drawn);
    free(live), free(room.at), free(memory), free(state);
    cdbm_close_player(&player);
    CDB_FREE(bytes);
    return 0;
}
"""
BODY = made_skeleton()
CPP17 = [*CXX[:1], "-std=c++17", *CXX[2:]]


def table(rng: random.Random) -> cdb.CompiledTable:
    """A table of every type, with derived facts, rules, weights and rows that rest."""
    n = 40
    cells = {
        "gait": ["Idle", "Walk Run", "Any", "not Idle"],
        "speed": ["<2", "1..4", "Any", "3..|..1"],
        "heading": ["-45..45", "Any", "170, 30"],
        "day": [">=2026-01-31", "Any"],
        "mood": ["calm", "Any", "Größe", "not calm"],
        "tags": ["+Move", "-InAir", "Any", "+Größe"],
        "heard": ["+shot", "Any", "not +shot.near"],
        "is_hurt": ["True", "False", "Any"],
        "When": ["", "", "speed * 2 > wounds"],
        "Weight": ["1", "2.5", "1"],
        "Rest": ["0", "0", "2"],
        "Prio": ["0", "0", "1"],
    }
    columns = {"Asset": [f"a{rng.randrange(25)}" for _ in range(n)]}
    columns |= {name: [rng.choice([of[0], "Any" if "Any" in of else of[0], *of]) for _ in range(n)] for name, of in cells.items()}
    settings = {
        "when": "When",
        "weight": "Weight",
        "cooldown_turns": "Rest",
        "priority": "Prio",
        "policy": "priority",
        "fallback": "idle",
    }
    return cdb.Table.from_columns(columns, SCHEMA, settings, name="moves").compile()


def moments(rng: random.Random) -> list[dict[str, object]]:
    return [
        {
            "gait": rng.choice(["Idle", "Walk", "Run"]),
            "speed": rng.choice([0.0, 0.5, 2.0, 3.25, 9.0]),
            "heading": rng.choice([0.0, -170.5, 45.0, 200.0]),
            "wounds": rng.randrange(6),
            "day": (date(2026, 1, 1) + timedelta(rng.randrange(60))).isoformat(),
            "mood": rng.choice(["calm", "Größe", "cross"]),
            "tags": rng.sample(["Move", "Move.Run", "InAir", "Größe"], rng.randrange(3)),
            "heard": rng.sample(["shot", "shot.near", "door"], rng.randrange(3)),
        }
        for _ in range(N_MOMENTS)
    ]


def answers(compiled: cdb.CompiledTable, asked: list[dict[str, object]]) -> list[tuple[list[int], int, str, int]]:
    """The rows, the row that is picked, its asset, and the digest, for each moment."""
    picker, found = compiled.picker(seed=7, memory=1), []
    for turn, facts in enumerate(asked):
        own = {**facts, "day": date.fromisoformat(str(facts["day"])), "tags": {*facts["tags"]}, "heard": {*facts["heard"]}}  # type: ignore[misc]
        valid = compiled.query(own)
        pick = picker.pick(valid, time_s=0.5 * turn)
        found.append((valid.rows.tolist(), -1 if pick.row is None else pick.row, pick.asset or "", picker.digest()))
    assert sum(row >= 0 for _, row, *_ in found) > N_MOMENTS / 2
    return found


@pytest.fixture
def project(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """The files of an example, with the header that it includes."""
    shutil.copytree(EXAMPLES / request.param, tmp_path, dirs_exist_ok=True)
    (tmp_path / "contextdb_motion.h").write_text(c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")), encoding="ascii")
    (tmp_path / "tables.h").write_text(c_header_of({}), encoding="ascii")
    (tmp_path / "cdb_link.h").write_text(c_link_of({}, "tables.h"), encoding="ascii")
    return tmp_path


@pytest.fixture(scope="module")
def square(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str], bytes]:
    """A bundle, and what a character of it plays in Python on a square, with all its poses."""
    folder = tmp_path_factory.mktemp("square")
    shutil.copytree(EXAMPLES / "web" / "tables", folder / "tables")
    (folder / "tables" / "clips").mkdir()
    motion.write_made_clips(folder / "tables" / "clips")
    assert run_contextdb(["motion", "build", str(folder / "tables"), "--bundle", str(folder / "game.motion")]) == 0
    character = motion.Character.of(cdb.Project.load(folder / "tables"), "player")
    poses, played = [], []
    for stick in [(0.0, 1.4), (1.4, 0.0), (0.0, -1.4), (-1.4, 0.0), (0.0, 0.0)]:
        for _ in range(90):
            updated = character.update(1.0 / 60.0, stick, {"gait": "Walk" if any(stick) else "Idle", "style": "normal"})
            assert updated.pose is not None
            assert updated.decision.playing is not None
            poses.append(np.concatenate([*map(np.ravel, (updated.pose.root, updated.pose.rotations, updated.pose.positions))]))
            played.append(updated.decision.playing.asset)
    return folder / "game.motion", played, np.array(poses).tobytes()


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sample tables' bundle, as the page of the engines makes it, beside the header."""
    folder = tmp_path_factory.mktemp("sample")
    shutil.copytree(EXAMPLES.parent / "tables", folder / "tables")
    motion.write_made_clips(folder / "tables" / "clips")
    assert run_contextdb(["motion", "build", str(folder / "tables"), "--bundle", str(folder / "game.motion")]) == 0
    (folder / "contextdb_motion.h").write_text(c_motion_header(c_header_of({}, "CDB_MOTION_READER_H")), encoding="ascii")
    return folder


def played(source: Path, folder: Path) -> str:
    """What a program prints that is compiled as the page says, in the folder of its header and its bundle."""
    command = [compiler_for(C), *C, *sanitizers(compiler_for(C)), "-ffp-contract=off"]
    return ran(c_compilers.compiled(command, source, folder / "program.exe", folder, "-lm"), cwd=folder)


def test_the_program_of_the_page_walks(sample: Path):
    source = (PROGRAMS / "walk.c").read_text(encoding="utf-8")
    assert f"```c\n{source}```" in PAGE
    assert f"```text\n{played(PROGRAMS / 'walk.c', sample)}```" in PAGE


def test_what_the_page_says_of_a_character_whose_memory_the_game_gives_is_compiled_and_plays(sample: Path):
    opening, frame = re.findall(r"```c\n((?:cdbm_bundle bundle;|cdb_set_text\(live, gait).*?)```", PAGE, re.S)
    (sample / "frame.c").write_text(FRAME.replace("OPENING", opening).replace("FRAME", frame), encoding="ascii")
    assert played(sample / "frame.c", sample).splitlines() == ["start_walk", "60"]


def needed(program: str, reason: str) -> str:
    path = shutil.which(program)
    if path is None:
        pytest.skip(f"{program} is not installed: {reason}")
    return path


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, encoding="utf-8", timeout=120)


@pytest.mark.parametrize("project", ["godot"], indirect=True)
def test_the_library_for_godot_is_built_without_a_warning(project: Path):
    assert built(project / "contextdb_godot.c", project / "libcontextdb.so", C, *LIBRARY).exists()


@pytest.mark.parametrize("project", ["godot"], indirect=True)
def test_godot_gives_the_rows_and_picks_of_python(project: Path):
    godot = needed("godot3-server", "Debian's package of that name runs scripts without a screen")
    built(project / "contextdb_godot.c", project / "libcontextdb.so", C, *LIBRARY)
    rng = random.Random(3)
    compiled, asked = table(rng), moments(rng)
    compiled.save(project / "moves.safetensors")
    (project / "moments.jsonl").write_text("".join(json.dumps(facts) + "\n" for facts in asked), encoding="utf-8")
    done = run(godot, "--path", ".", "-s", "main.gd", cwd=project)
    lines = [json.loads(line) for line in (project / "answers.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [line["problem"] for line in lines] == [""] * N_MOMENTS, done.stderr
    found = [([*map(int, line["rows"])], int(line["row"]), line["asset"], int(line["digest"]) % 2**64) for line in lines]
    assert found == answers(compiled, asked)


@pytest.mark.parametrize("project", ["godot"], indirect=True)
@pytest.mark.parametrize(
    ("contents", "facts", "why"),
    [
        (b"not a table", {}, "the file is too short for its header"),
        (None, {}, "the file cannot be read"),
        (b"", {"speed": "fast"}, "speed: the fact is not one that the condition can have"),
        (b"", {"speed": 1.0}, "wounds: the fact is missing"),
    ],
)
def test_godot_says_what_is_wrong(project: Path, contents: bytes | None, facts: dict[str, object], why: str):
    godot = needed("godot3-server", "Debian's package of that name runs scripts without a screen")
    built(project / "contextdb_godot.c", project / "libcontextdb.so", C, *LIBRARY)
    if contents:
        (project / "moves.safetensors").write_bytes(contents)
    elif contents is not None:
        table(random.Random(3)).save(project / "moves.safetensors")
    (project / "moments.jsonl").write_text(json.dumps(facts) + "\n", encoding="utf-8")
    done = run(godot, "--path", ".", "-s", "main.gd", cwd=project)
    assert why in done.stderr + (project / "answers.jsonl").read_text(encoding="utf-8")


@pytest.mark.parametrize("project", ["godot"], indirect=True)
def test_in_godot_a_character_walks_a_square_as_in_python(project: Path, square: tuple[Path, list[str], bytes]):
    godot = needed("godot3-server", "Debian's package of that name runs scripts without a screen")
    built(project / "contextdb_godot.c", project / "libcontextdb.so", C, *LIBRARY)
    bundle, played, poses = square
    shutil.copyfile(bundle, project / "game.motion")
    done = run(godot, "--path", ".", "-s", "walk.gd", cwd=project)
    assert [line.split("|")[0] for line in (project / "poses.txt").read_text().splitlines()] == played, done.stderr
    assert (project / "poses.bin").read_bytes() == poses
    (project / "game.motion").write_bytes(b"CDBMOTN0")
    assert "it is no bundle of motion" in run(godot, "--path", ".", "-s", "walk.gd", cwd=project).stderr


@pytest.mark.parametrize("project", ["unity"], indirect=True)
def test_mono_gives_the_rows_and_picks_of_python(project: Path):
    mono, compiler = needed("mono", "it runs C# as Unity does"), needed("mcs", "mono's compiler of C#")
    built(project / "contextdb.c", project / "libcontextdb.so", C, *LIBRARY)
    assert run(compiler, "-warnaserror", "ContextTable.cs", "Play.cs", "-out:Play.exe", cwd=project).returncode == 0
    rng = random.Random(4)
    compiled, asked = table(rng), moments(rng)
    compiled.save(project / "moves.safetensors")
    texts = [
        "\t".join(f"{name}={' '.join(value) if isinstance(value, list) else value}" for name, value in facts.items())
        for facts in asked
    ]
    (project / "moments.txt").write_text("\n".join(texts) + "\n", encoding="utf-8")
    done = run(
        "env", f"LD_LIBRARY_PATH={project}", "LC_ALL=C.UTF-8", mono, "Play.exe", "moves.safetensors", "moments.txt", cwd=project
    )
    assert done.returncode == 0, done.stderr
    found = []
    for line in done.stdout.splitlines():
        rows, row, asset, digest = line.split("|")
        found.append(([*map(int, rows.split())], int(row), asset, int(digest)))
    assert found == answers(compiled, asked)
    (project / "bad.txt").write_text("speed=1.0\tgait=Swim\n", encoding="utf-8")
    done = run("env", f"LD_LIBRARY_PATH={project}", mono, "Play.exe", "moves.safetensors", "bad.txt", cwd=project)
    assert (done.returncode, done.stderr) == (1, "gait: the fact is not one that the condition can have\n")
    (project / "moves.safetensors").write_bytes(b"\0" * 40)
    done = run("env", f"LD_LIBRARY_PATH={project}", mono, "Play.exe", "moves.safetensors", "bad.txt", cwd=project)
    assert (done.returncode, done.stdout) == (1, "")
    assert "header" in done.stderr


@pytest.mark.parametrize("project", ["unity"], indirect=True)
def test_in_mono_a_character_walks_a_square_as_in_python(project: Path, square: tuple[Path, list[str], bytes]):
    mono, compiler = needed("mono", "it runs C# as Unity does"), needed("mcs", "mono's compiler of C#")
    built(project / "contextdb.c", project / "libcontextdb.so", C, *LIBRARY)
    sources = "ContextTable.cs", "ContextCharacters.cs", "Walk.cs"
    done = run(compiler, "-warnaserror", *sources, "-out:Walk.exe", cwd=project)
    assert done.returncode == 0, done.stdout + done.stderr
    bundle, played, poses = square
    done = run("env", f"LD_LIBRARY_PATH={project}", mono, "Walk.exe", bundle, "poses.bin", cwd=project)
    assert [line.split("|")[0] for line in done.stdout.splitlines()] == played, done.stderr
    assert (project / "poses.bin").read_bytes() == poses
    (project / "bad.motion").write_bytes(b"CDBMOTN0")
    done = run("env", f"LD_LIBRARY_PATH={project}", mono, "Walk.exe", "bad.motion", "poses.bin", cwd=project)
    assert (done.returncode, done.stderr) == (1, "it is no bundle of motion\n")


# ---- facts as types of the engines

FACTS = {
    "gait": "Run",
    "speed": 3.25,
    "heading": -170.5,
    "wounds": 4,
    "day": "2026-02-03",
    "mood": "Größe",
    "tags": ["Größe"],
    "heard": ["shot"],
}
CSHARP = """
using System;
using ContextDB;

static class Game
{
    static void Main()
    {
        using (var table = ContextTable.Open("moves.safetensors", 7))
        {
            var facts = new MovesFacts(table);
            facts.Gait = Gait.Run;
            facts.Speed = 3.25;
            facts.Heading = -170.5;
            facts.Wounds = 4;
            facts.Day = new DateTime(2026, 2, 3);
            facts.Mood = "Gr\u00f6\u00dfe";
            facts.Tags = new[] { "Gr\u00f6\u00dfe" };
            facts.Heard = new[] { "shot" };
            table.Query();
            Console.WriteLine(string.Join(" ", table.Rows));
        }
    }
}
"""
GDSCRIPT = """extends SceneTree

const Facts = preload("res://facts.gd")
const ContextTable = preload("res://context_table.gdns")

func _init():
	var facts = Facts.MovesFacts.new()
	facts.fact_Gait = Facts.Gait.Run
	facts.fact_Speed = 3.25
	facts.fact_Heading = -170.5
	facts.fact_Wounds = 4
	facts.fact_Day = "2026-02-03"
	facts.fact_Mood = "Größe"
	facts.fact_Tags = ["Größe"]
	facts.fact_Heard = ["shot"]
	var table = ContextTable.new()
	table.open(ProjectSettings.globalize_path("res://moves.safetensors"), 7)
	var answer = File.new()
	answer.open("res://answer.json", File.WRITE)
	answer.store_string(to_json(table.query(facts.facts())))
	answer.close()
	quit()
"""
UNREAL = """#define CDB_FILES
#include <stdio.h>
#include "Facts.h"

int main(int argc, char **argv)
{
    size_t size = 0;
    void *bytes = cdb_read_file(argv[argc - 1], &size, NULL);
    cdb_any *any = cdb_open_any(bytes, size, NULL);
    cdb_live *live = cdb_live_of(any, CDB_UNKNOWN_ERROR, malloc(cdb_live_bytes(&any->schema)));
    uint64_t rows[1];
    FCdbTexts texts;
    FMovesFacts facts;
    facts.Gait = EGait::Run;
    facts.Speed = 3.25;
    facts.Heading = -170.5;
    facts.Wounds = 4;
    facts.Day = "2026-02-03";
    facts.Mood = "Gr\\xc3\\xb6\\xc3\\x9f" "e";
    facts.Tags.Add("Gr\\xc3\\xb6\\xc3\\x9f" "e");
    facts.Heard.Add("shot");
    for (int again = 0; again < 2; again++)
        if (!facts.SetIn(live, texts) || cdb_live_query(live, rows, 1, NULL) != CDB_OK) return 1;
    for (int64_t row = -1; (row = cdb_next_row(rows, 1, row)) >= 0;) printf("%d ", (int)row);
    free(live);
    cdb_close_any(any);
    CDB_FREE(bytes);
    return 0;
}
"""
ENGINE = """// What the struct needs of Unreal, as simple as it can be.
#pragma once
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>
#define UENUM(...)
#define UMETA(...)
#define USTRUCT(...)
#define UPROPERTY(...)
#define GENERATED_BODY()
typedef std::uint8_t uint8;
typedef std::int32_t int32;
typedef std::int64_t int64;
typedef char ANSICHAR;
struct FString : std::string { using std::string::string; const char *operator*() const { return c_str(); } };
struct FTCHARToUTF8 {
    explicit FTCHARToUTF8(const char *given) : text(given) {}
    const char *Get() const { return text; }
    int32 Length() const { return static_cast<int32>(std::strlen(text)); }
    const char *text;
};
template <typename T> struct TArray : std::vector<T> {
    void Add(const T &one) { this->push_back(one); }
    void Append(const T *from, int32 n) { this->insert(this->end(), from, from + n); }
    void AddZeroed(int32 n) { this->resize(this->size() + static_cast<std::size_t>(n)); }
    T &AddDefaulted_GetRef() { this->emplace_back(); return this->back(); }
    T *GetData() { return this->data(); }
    int32 Num() const { return static_cast<int32>(this->size()); }
    void Reset() { this->clear(); }
};
struct FMemory { static void Memcpy(void *to, const void *from, std::size_t n) { std::memcpy(to, from, n); } };
"""


def rows_of_facts(compiled: cdb.CompiledTable) -> list[int]:
    own = {**FACTS, "day": date(2026, 2, 3), "tags": {"Größe"}, "heard": {"shot"}}
    rows: list[int] = compiled.query(own).rows.tolist()
    assert rows
    return rows


@pytest.mark.parametrize("project", ["unreal"], indirect=True)
def test_in_the_part_for_unreal_a_character_walks_a_square_as_in_python(project: Path, square: tuple[Path, list[str], bytes]):
    options = [*CPP17, *sanitizers(compiler_for(CPP17)), "-ffp-contract=off"]
    program = built(project / "Walk.cpp", project / "Walk.exe", options)
    bundle, played, poses = square
    done = run(program, bundle, "poses.bin", "joints.bin", cwd=project)
    assert [line.split("|")[0] for line in done.stdout.splitlines()] == played, done.stderr
    assert (project / "poses.bin").read_bytes() == poses
    numbers, in_unreal = (np.fromfile(project / name).reshape(len(played), -1) for name in ("poses.bin", "joints.bin"))
    places = numbers[:, -(in_unreal.shape[1] - 3) // 4 :].reshape(len(played), -1, 3)
    axes = in_unreal[:, 3:].reshape(len(played), -1, 4, 3)  # X, Y and Z of each joint, then its place
    x, z, heading = numbers[:, :3].T
    np.testing.assert_allclose(in_unreal[:, :3], np.transpose([100.0 * z, -100.0 * x, np.degrees(-heading)]), atol=1e-9)
    np.testing.assert_allclose(axes[:, :, 3], 100.0 * places[:, :, [2, 0, 1]] * [1.0, -1.0, 1.0], atol=1e-3)
    np.testing.assert_allclose(np.linalg.det(axes[:, :, :3]), 1.0, atol=1e-5)
    for joint, parent in enumerate(BODY.parents.tolist()):
        if parent >= 0:  # a joint is where its parent's axes carry its offset
            left, up, ahead = BODY.offsets[joint]  # centimetres
            carried = np.einsum("a,tad->td", [ahead, -left, up], axes[:, parent, :3])
            np.testing.assert_allclose(axes[:, joint, 3] - axes[:, parent, 3], carried, atol=1e-3)
    (project / "bad.motion").write_bytes(b"CDBMOTN0")
    done = run(program, "bad.motion", "poses.bin", "joints.bin", cwd=project)
    assert (done.returncode, done.stderr) == (1, "it is no bundle of motion\n")


@pytest.mark.parametrize("project", ["unity"], indirect=True)
def test_facts_in_csharp_are_those_of_the_table(project: Path):
    mono, compiler = needed("mono", "it runs C# as Unity does"), needed("mcs", "mono's compiler of C#")
    built(project / "contextdb.c", project / "libcontextdb.so", C, *LIBRARY)
    compiled = table(random.Random(4))
    compiled.save(project / "moves.safetensors")
    (project / "Facts.cs").write_text(csharp_of({"moves": compiled}), encoding="utf-8")
    (project / "Game.cs").write_text(CSHARP, encoding="utf-8")
    done = run(compiler, "-warnaserror", "ContextTable.cs", "Facts.cs", "Game.cs", "-out:Game.exe", cwd=project)
    assert done.returncode == 0, done.stdout + done.stderr
    done = run("env", f"LD_LIBRARY_PATH={project}", mono, "Game.exe", cwd=project)
    assert [*map(int, done.stdout.split())] == rows_of_facts(compiled), done.stderr


@pytest.mark.parametrize("project", ["godot"], indirect=True)
def test_facts_in_gdscript_are_those_of_the_table(project: Path):
    godot = needed("godot3-server", "Debian's package of that name runs scripts without a screen")
    built(project / "contextdb_godot.c", project / "libcontextdb.so", C, *LIBRARY)
    compiled = table(random.Random(4))
    compiled.save(project / "moves.safetensors")
    (project / "facts.gd").write_text(godot_of({"moves": compiled}), encoding="utf-8")
    (project / "game.gd").write_text(GDSCRIPT, encoding="utf-8")
    done = run(godot, "--path", ".", "-s", "game.gd", cwd=project)
    assert json.loads((project / "answer.json").read_text(encoding="utf-8")) == rows_of_facts(compiled), done.stderr


def test_facts_for_unreal_are_those_of_the_table(tmp_path: Path):
    compiled = table(random.Random(4))
    compiled.save(tmp_path / "moves.safetensors")
    (tmp_path / "tables.h").write_text(c_header_of({}), encoding="ascii")
    (tmp_path / "CoreMinimal.h").write_text(ENGINE, encoding="ascii")
    (tmp_path / "Facts.generated.h").write_text("", encoding="ascii")
    (tmp_path / "Facts.h").write_text(unreal_of({"moves": compiled}, "Facts"), encoding="utf-8")
    (tmp_path / "game.cpp").write_text(UNREAL, encoding="ascii")
    program = built(tmp_path / "game.cpp", tmp_path / "game.exe", CPP17, *sanitizers(compiler_for(CPP17)))
    assert [*map(int, ran(program, tmp_path / "moves.safetensors").split())] == rows_of_facts(compiled)


def test_samples_with_odd_names_are_written_for_every_engine():
    schema = {name: {"type": "enum", "values": ["ö", "a b", "1", "class"]} for name in ("class", "Größe", "a b", "A.b", "1")}
    odd = cdb.Table.from_columns({"Asset": ["x"], **{name: ["Any"] for name in schema}}, schema, name="int").compile()
    assert "public enum Class\n" in csharp_of({"int": odd, "Int": odd})
    assert 'const Class = {"T": "ö", "AB": "a b", "T1": "1", "Class": "class"}' in godot_of({"int": odd})
    assert "enum class EClass : uint8" in unreal_of({"int": odd}, "x")
