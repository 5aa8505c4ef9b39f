"""Hostile peers: whatever a listener sends to a game, or a game to a listener, is bounded, and costs the game nothing."""

import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from links import FACTS, LIMIT_S, listening, meeting, next_lines, table, until
from running import run

import contextdb as cdb
from contextdb.telemetry.link import doors, hearing, listeners, writer
from contextdb.telemetry.link.doors import connected
from contextdb.telemetry.link.lines import MOST_DEPTH, MOST_NAME

__all__ = ["meeting"]
pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="sockets in folders of a user are of Unix")

Peer = Callable[[Path], socket.socket]


def sends(*parts: bytes) -> Peer:
    def peer(path: Path) -> socket.socket:
        connection = connected(path)
        with suppress(OSError):
            for part in parts:
                connection.sendall(part)
        return connection

    return peer


PEERS: dict[str, Peer] = {
    "garbage": sends(os.urandom(3000) + b"\n"),
    "an endless line": sends(*[b"x" * 1000] * 1000),
    "endless lines": sends(b"{}\n" * 100_000),
    "deep JSON": sends(b'{"who":' + b"[" * 3000 + b"\n"),
    "half a line": sends(b'{"every"'),
    "names without end": sends(b'{"who":["' + b"x" * 3000 + b'"]}\n', b'{"tables":["' + b"x" * 5000 + b'"]}\n'),
    "lone surrogates": sends(b'{"token":"\\ud800","who":["\\ud800"]}\n', b"}\n"),
}


@pytest.mark.parametrize("name", PEERS)
def test_a_hostile_peer_is_disconnected_while_the_game_and_other_listeners_go_on(
    meeting: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    monkeypatch.setattr(listeners, "REQUEST_S", 0.05)
    jog = table()
    with cdb.link("game", per_second=60) as link:
        link.watch(jog)
        with listening(link, meeting, every=True) as good, PEERS[name](meeting / "game.sock") as peer:
            until(lambda: len(link._writer._listeners) == 1)
            with suppress(ConnectionError):
                while peer.recv(1 << 16):
                    pass
            jog.query(FACTS)
            assert next_lines(good, "ask")[0]["facts"] == FACTS
    assert not link._writer._thread.is_alive()


def test_a_peer_that_never_reads_is_disconnected_and_blocks_nobody(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(listeners, "STALLED_S", 0.05)
    monkeypatch.setattr(listeners, "MOST_PENDING", 1 << 14)
    jog = table()
    with cdb.link("game", per_second=60) as link:
        link.watch(jog)
        with connected(meeting / "game.sock") as stalled, listening(link, meeting) as good:
            stalled.sendall(b'{"every":true}\n')
            until(lambda: len(link._writer._listeners) == 2)

            def is_gone() -> bool:
                jog.query({**FACTS, "story": "x" * 5000})
                return len(link._writer._listeners) == 1

            until(is_gone)
            assert next_lines(good, "ask")


def test_connections_without_end_are_closed_and_leave_room_when_they_go(meeting: Path):
    with cdb.link("game") as link:
        most: list[int] = []
        for _ in range(300):
            connected(meeting / "game.sock").close()
            most.append(len(link._writer._listeners))
        held = [connected(meeting / "game.sock") for _ in range(writer.MOST_LISTENERS + 5)]
        until(lambda: len(link._writer._listeners) == writer.MOST_LISTENERS)
        assert max(most) <= writer.MOST_LISTENERS
        for one in held:
            one.close()
        until(lambda: not link._writer._listeners)
        with listening(link, meeting):
            assert link.is_heard


def test_a_link_closes_in_bounded_time_though_its_thread_is_stuck(meeting: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(writer, "CLOSE_S", 0.05)
    go_on = threading.Event()
    monkeypatch.setattr(listeners.FileListener, "send", lambda self: go_on.wait(LIMIT_S))
    link = cdb.link("game", record=tmp_path / "m.jsonl")
    began_s = time.monotonic()
    link.close()
    assert time.monotonic() - began_s < LIMIT_S / 2
    assert link._writer._thread.is_alive()
    go_on.set()
    link._writer._thread.join(LIMIT_S)
    assert list(meeting.iterdir()) == []


def test_a_link_or_a_file_in_place_of_a_socket_is_neither_followed_nor_deleted(meeting: Path, tmp_path: Path):
    meeting.mkdir(mode=0o700)
    (meeting / "game.sock").symlink_to(tmp_path / "nowhere")
    (meeting / "game-2.sock").write_text("mine")
    (meeting / "game-3.port").symlink_to(tmp_path / "nowhere")
    with cdb.link("game") as link:
        assert link.name == "game-3"
        assert [name for name, _ in doors.doors()] == ["game-3"]
    assert sorted(path.name for path in meeting.iterdir()) == ["game-2.sock", "game-3.port", "game.sock"]
    assert (meeting / "game-2.sock").read_text() == "mine"


def test_a_runtime_folder_that_others_may_write_to_is_passed_over(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(doors.tempfile, "tempdir", str(meeting.parent))
    meeting.parent.chmod(0o770)
    assert doors.runtime_folder() == meeting.parent / f"contextdb-{os.getuid()}"


def test_a_program_that_holds_the_folder_does_not_stop_a_game(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(doors, "TURN_S", 0.0)
    with doors.turn(doors.runtime_folder()), pytest.raises(cdb.FileError, match="another program holds the folder"):
        cdb.link("game")


# ---- a game that is hostile


HEADER = {"line": "header", "format": 1, "game": "\x1b[2Jgame", "pid": 10**300, "tables": {"\x1b]0;x\x07": {}, "t" * 900: {}}}
ASK = {"line": "ask", "t": 1.0, "who": "a", "table": "x", "facts": {"a": 1}, "rows": "1", "valid": 1}


def lines(*given: object) -> bytes:
    return b"".join(line if isinstance(line, bytes) else json.dumps(line).encode() + b"\n" for line in given)


@contextmanager
def hostile_game(sent: bytes, name: str = "game") -> Iterator[None]:
    """A game that sends this to who connects, slowly where it is half a header."""
    door, is_over = doors.opened(name), threading.Event()
    door.server.settimeout(0.05)

    def serve() -> None:
        while not is_over.is_set():
            with suppress(OSError):
                connection, _ = door.server.accept()
                with connection:
                    connection.settimeout(LIMIT_S)
                    connection.sendall(sent)
                    while not sent.endswith(b"\n") and not is_over.wait(0.01):
                        connection.sendall(b" ")
                    connection.shutdown(socket.SHUT_WR)
                    while connection.recv(1 << 16):
                        pass

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join(LIMIT_S)
        door.close()


HOSTILE = {
    "control characters": lines(HEADER, {**ASK, "who": "\x1b[2J\u202e", "facts": {"\x07": "\x1b]0;x\x07"}}),
    "huge facts": lines(HEADER, {**ASK, "facts": {f"f{n}": "x" * 90 for n in range(8000)}}),
    "many characters": lines(HEADER, *({**ASK, "who": f"w{n}"} for n in range(3000))),
    "a decision of nothing": lines(HEADER, {"line": "decision", "t": 1, "who": None, "decision": {"action": {"a": [1]}, "why": 3}}),
    "huge numbers": lines(HEADER, {**ASK, "t": 10**308, "valid": 10**4000, "facts": {"a": 10**4000}}),
}
REFUSED = {
    "a name without end": lines(HEADER, {**ASK, "who": "x" * (MOST_NAME + 1)}),
    "NaN": lines(HEADER, b'{"line":"ask","t":NaN,"who":null,"table":"x","facts":{},"rows":"0","valid":0}\n'),
    "a time past all": lines(HEADER, b'{"line":"ask","t":1e999,"who":null,"table":"x","facts":{},"rows":"0","valid":0}\n'),
    "deep JSON": lines(HEADER, b'{"line":"decision","t":1,"who":null,"decision":{"a":' + b"[" * 900 + b"]" * 900 + b"}}\n"),
    "deep facts": lines(HEADER, {**ASK, "facts": {"a": json.loads("[" * MOST_DEPTH + "]" * MOST_DEPTH)}}),
    "a line without end": lines(HEADER) + b"x" * (1 << 21) + b"\n",
    "garbage": lines(HEADER) + b"\xff\n",
}


@pytest.mark.parametrize("name", [*HOSTILE, *REFUSED])
def test_what_a_hostile_game_sends_is_escaped_and_bounded_or_refused(meeting: Path, name: str):
    with hostile_game(HOSTILE.get(name) or REFUSED[name]):
        done = run("live", "game", "--explain", "--tables", "tables")
    assert done.code == (2 if name in REFUSED else 0)
    assert all(line.isprintable() and len(line) < 30_000 for line in (*done.out.splitlines(), *done.err.splitlines()))
    assert "Traceback" not in done.err


def test_hostile_games_are_listed_without_what_moves_the_cursor(meeting: Path):
    with hostile_game(lines(HEADER)), hostile_game(lines(HEADER), "other"):
        done = run("live")
    assert (done.code, len(done.lines)) == (0, 3)
    assert all(line.isprintable() for line in done.lines)


def test_a_game_that_never_ends_its_header_is_given_up(meeting: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(hearing, "HEADER_S", 0.2)
    with hostile_game(b'{"line":'):
        assert hearing.games() == []


def test_of_many_characters_of_a_game_the_first_are_forgotten(monkeypatch: pytest.MonkeyPatch):
    from contextdb.commands import live_command

    monkeypatch.setattr(live_command, "MOST_KNOWN_BYTES", 1000)
    changes = live_command.Changes({}, False)
    for number in range(100):
        assert changes.of({**ASK, "who": f"w{number}"}, 100).lines
    assert len(changes._known) == 10
    assert changes.of({**ASK, "who": "w99"}, 100).lines == ()
    assert changes.of({**ASK, "who": "w0"}, 100).lines
