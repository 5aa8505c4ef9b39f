"""Where a game is met: only by programs of the same user; and no listener, however bad, costs the game anything."""

import gc
import json
import os
import socket
import stat
import subprocess
import sys
import threading
import tracemalloc
from contextlib import suppress
from pathlib import Path

import pytest
from links import FACTS, LIMIT_S, listening, meeting, next_lines, table, until
from strategies import IS_FULL

import contextdb as cdb
from contextdb.telemetry.link import doors, hearing, listeners
from contextdb.telemetry.link.doors import connected
from contextdb.telemetry.link.listeners import MOST_PENDING

__all__ = ["meeting"]
pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="sockets in folders of a user are of Unix")


def mode(path: Path) -> int:
    return stat.S_IMODE(os.lstat(path).st_mode)


def test_folder_and_socket_are_the_users_alone(meeting: Path):
    with cdb.link("game"):
        assert mode(meeting) == 0o700
        assert mode(meeting / "game.sock") == 0o600
        assert [path.name for path in meeting.iterdir()] == ["game.sock"]
    assert list(meeting.iterdir()) == []


@pytest.mark.parametrize("wide", [0o750, 0o701, 0o777])
def test_a_folder_that_others_may_open_is_refused(meeting: Path, wide: int):
    meeting.mkdir()
    meeting.chmod(wide)
    with pytest.raises(cdb.FileError, match="others may open the folder"):
        cdb.link("game")
    with pytest.raises(cdb.FileError, match="chmod 700"):
        hearing.games()


def test_a_folder_of_another_user_is_refused(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    meeting.mkdir(mode=0o700)
    found = os.lstat(meeting)
    stranger = os.stat_result((found.st_mode, *found[1:4], found.st_uid + 1, *found[5:]))
    monkeypatch.setattr(doors.os, "lstat", lambda path, **options: stranger)
    with pytest.raises(cdb.FileError, match="belongs to another user"):
        cdb.link("game")


def test_a_link_in_place_of_the_folder_is_refused(meeting: Path, tmp_path: Path):
    tmp_path.chmod(0o700)
    meeting.symlink_to(tmp_path)
    with pytest.raises(cdb.FileError, match="is not a folder"):
        cdb.link("game")


def test_a_runtime_folder_of_another_user_is_passed_over(monkeypatch: pytest.MonkeyPatch, meeting: Path):
    monkeypatch.setenv("TMPDIR", str(meeting.parent))
    monkeypatch.setattr(doors.tempfile, "tempdir", None)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "relative")
    assert doors.runtime_folder() == meeting.parent / f"contextdb-{os.getuid()}"


def test_who_connects_as_another_user_is_sent_nothing(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    from contextdb.telemetry.link import writer

    with cdb.link("game"):
        monkeypatch.setattr(writer, "is_same_user", lambda connection: False)
        with connected(meeting / "game.sock") as stranger:
            assert stranger.recv(100) == b""


@pytest.mark.skipif(not hasattr(socket, "SO_PEERCRED"), reason="the system does not say who connects")
def test_the_system_says_who_connects(monkeypatch: pytest.MonkeyPatch):
    one, other = socket.socketpair()
    with one, other:
        assert doors.is_same_user(one)
        own = os.getuid()
        monkeypatch.setattr(doors.os, "getuid", lambda: own + 1)
        assert not doors.is_same_user(one)


@pytest.mark.parametrize("name", ["", ".", "..", "../x", "a/b", "a\\b", "/etc/x", "a b", "a\0b", "-x", "x.", "ä", "x" * 41, "a\n"])
def test_what_could_be_a_path_is_no_name(meeting: Path, name: str):
    with pytest.raises(cdb.ContextError, match="is not the name of a game"):
        cdb.link(name)


def test_a_name_that_is_refused_comes_with_one_like_it(meeting: Path):
    with pytest.raises(cdb.ContextError, match='Did you mean "my-game"'):
        cdb.link("my game!")
    with pytest.raises(cdb.ContextError):
        cdb.link(3)  # type: ignore[arg-type]


def test_two_games_of_one_name_get_two(meeting: Path):
    with cdb.link("game") as one, cdb.link("game") as two, cdb.link("x.y") as three:
        assert [one.name, two.name, three.name] == ["game", "game-2", "x.y"]
        assert [game.name for game in hearing.games()] == ["game", "game-2", "x.y"]
    assert hearing.games() == []


def test_the_socket_of_a_game_that_was_killed_is_swept(meeting: Path):
    script = "import contextdb, os; link = contextdb.link('game'); print(link.name, flush=True); os.kill(os.getpid(), 9)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout == "game\n"
    assert (meeting / "game.sock").exists()
    assert hearing.games() == []
    assert list(meeting.iterdir()) == []
    subprocess.run([sys.executable, "-c", script], capture_output=True)
    with cdb.link("game") as link:
        assert link.name == "game"


def test_a_game_that_ends_sweeps_behind_itself(meeting: Path):
    script = "import contextdb; contextdb.link('game')"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0
    assert hearing.games() == []


def test_a_listener_that_wants_some_gets_those(meeting: Path):
    jog, other = table(), table(schema={"x": {"type": "bool"}})
    with cdb.link("game") as link:
        link.watch(jog, "player")
        live = other.live(FACTS)
        link.watch(live, "npc")
        with listening(link, meeting, who=["npc"]) as heard:
            jog.query(FACTS)
            live.matches()
            assert [line["who"] for line in next_lines(heard, "ask")] == ["npc"]
        until(lambda: not link.is_heard)
        with listening(link, meeting, tables=["none"], every=True) as heard:
            jog.query(FACTS)
            link.close()
            assert [line["line"] for batch in heard.batches() for _, line in batch if line["line"] != "tables"] == ["end"]


def test_a_listener_that_stalls_loses_lines_and_is_told_how_many(meeting: Path):
    jog = table()
    long = {**FACTS, "gait": "Walk", "story": "x" * 4000}
    with cdb.link("game", per_second=60) as link:
        link.watch(jog)
        with listening(link, meeting, every=True) as heard:
            until(lambda: link._writer._listeners and link._writer._listeners[0].wants_every)
            [listener] = link._writer._listeners
            n_asked = 0
            while listener.has_room:
                n_at_once = 1 if len(listener._pending) > MOST_PENDING - 20 * 4400 else 10
                for _ in range(n_at_once):
                    jog.query(long)
                n_asked += n_at_once
                until(lambda: not link._feed.entries)
            assert len(listener._pending) < MOST_PENDING + 2 * 4400
            for _ in range(50):
                jog.query(long)
            until(lambda: not link._feed.entries)
            until(lambda: listener.n_lost > 0)
            got, lost = 0, 0
            for batch in heard.batches():
                got += sum(line["line"] == "ask" for _, line in batch)
                lost += sum(line["count"] for _, line in batch if line["line"] == "lost")
                if lost:
                    break
        assert lost > 0
        assert got + lost == n_asked + 50


def test_a_thousand_listeners_that_come_and_go_leave_nothing_behind(meeting: Path):
    jog = table()
    with cdb.link("game", per_second=60) as link:
        link.watch(jog, "player")

        def come_and_go(n: int) -> None:
            for number in range(n):
                with connected(meeting / "game.sock") as one:
                    if number % 3:
                        one.sendall(b'{"format":1,"every":true}\n')
                    if number % 2:
                        one.recv(10)
                    jog.query(FACTS)
            until(lambda: not link._writer._listeners and not link.is_heard)

        come_and_go(50)
        gc.collect()
        descriptors, threads = set(os.listdir("/dev/fd")), threading.active_count()
        tracemalloc.start()
        come_and_go(20)
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        come_and_go(1000 if IS_FULL else 250)
        gc.collect()
        after = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
        assert len(set(os.listdir("/dev/fd"))) == len(descriptors)
        assert threading.active_count() == threads
        assert after - before < (200_000 if IS_FULL else 50_000)
        assert len(link._writer._selector.get_map()) == 2


def test_links_that_come_and_go_leave_nothing_behind(meeting: Path):
    with cdb.link("game"):
        pass
    descriptors, threads = len(os.listdir("/dev/fd")), threading.active_count()
    for _ in range(20):
        with cdb.link("game") as link:
            link.watch(table())
            listening(link, meeting).close()
    assert len(os.listdir("/dev/fd")) == descriptors
    assert threading.active_count() == threads


def test_a_game_that_hangs_up_in_the_middle_of_a_line_is_gone(meeting: Path):
    with cdb.link("game") as link:
        heard = listening(link, meeting)
        [listener] = link._writer._listeners
        listener.connection.shutdown(socket.SHUT_RDWR)
        assert list(heard.batches()) in ([], [[]])


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (b'{"line":"end"}\n', "not the header"),
        (b"GET / HTTP/1.1\r\n", "cannot be read"),
        (b'{"line":"header","format":9,"game":"x","pid":1,"tables":{}}\n', "format 9"),
        (b"x" * (1 << 21), "does not end"),
    ],
)
def test_lines_that_are_no_games_are_refused(sent: bytes, why: str):
    ours, theirs = socket.socketpair()
    with theirs:
        sender = threading.Thread(target=lambda: _all(theirs, sent))
        sender.start()
        with pytest.raises(cdb.ContextDBError, match=why):
            hearing.Hearing(Path("x.sock"), ours, hearing.Wanted())
        sender.join(LIMIT_S)


def _all(connection: socket.socket, sent: bytes) -> None:
    with suppress(OSError):
        connection.sendall(sent)


# ---- a port of the machine itself, where there are no such sockets


@pytest.fixture
def by_port(meeting: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(doors, "IS_UNIX", False)
    return meeting / "game.port"


def test_without_sockets_of_files_a_game_is_met_at_a_port_with_a_token(by_port: Path):
    jog = table()
    with cdb.link("game") as link:
        link.watch(jog, "player")
        assert mode(by_port) == 0o600
        assert link._writer.door.server.getsockname()[0] == "127.0.0.1"
        [game] = hearing.games()
        assert game.path == by_port
        with hearing.hear(game.path) as heard:
            until(lambda: link.is_heard)
            jog.query(FACTS)
            assert next_lines(heard, "ask")[0]["facts"] == FACTS
    assert not by_port.exists()


@pytest.mark.parametrize("token", ["", "0" * 64, "\u00e9"])
def test_who_does_not_know_the_token_is_sent_nothing(by_port: Path, token: str):
    with cdb.link("game") as link:
        link.watch(table())
        for request in (json.dumps({"token": token}).encode() + b"\n", b"{}\n"):
            with connected(by_port) as stranger:
                stranger.sendall(request)
                assert stranger.recv(100) == b""
        assert not link.is_heard


def test_who_says_nothing_to_a_port_is_sent_nothing(by_port: Path):
    with cdb.link("game") as link, connected(by_port) as stranger:
        until(lambda: link._writer._listeners)
        stranger.settimeout(0.1)
        with pytest.raises(TimeoutError):
            stranger.recv(1)
        assert not link.is_heard


def test_who_owes_the_token_too_long_is_disconnected(by_port: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(listeners, "REQUEST_S", 0.05)
    with cdb.link("game"), connected(by_port) as stranger:
        stranger.settimeout(LIMIT_S)
        assert stranger.recv(1) == b""


def test_a_file_with_a_port_that_others_may_read_is_passed_over(by_port: Path):
    with cdb.link("game"):
        by_port.chmod(0o644)
        assert hearing.games() == []
        by_port.chmod(0o600)


@pytest.mark.parametrize(
    "said", [b"", b"[1]", b'{"port":null,"token":"a"}', b'{"port":70000,"token":"a"}', b'{"port":"x","token":"a"}']
)
def test_a_file_with_a_port_that_says_none_is_passed_over(by_port: Path, said: bytes):
    with cdb.link("game"):
        whole = by_port.read_bytes()
        by_port.write_bytes(said)
        assert hearing.games() == []
        by_port.write_bytes(whole)


def test_the_port_of_a_game_that_was_killed_is_swept(by_port: Path):
    with cdb.link("game") as link:
        said = by_port.read_bytes()
        assert link.name == "game"
    by_port.write_bytes(said)
    by_port.chmod(0o600)
    assert hearing.games() == []
    assert not by_port.exists()
