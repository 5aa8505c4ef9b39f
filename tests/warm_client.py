"""Stand for a process that `warm_start` forked: its folder, environment, streams, signals and end are those of this one.

Started as `python -S warm_client.py SOCKET WORDS`. It imports nothing that is not in the interpreter, so that it starts at once.
"""

import _signal
import _socket
import marshal
import os
import sys


def main() -> None:
    streams = [(s.encoding, s.errors, s.line_buffering, s.write_through) for s in (sys.stdin, sys.stdout, sys.stderr)]
    told = marshal.dumps((os.getcwdb(), dict(os.environb), sys.argv[2:], streams))
    link = _socket.socket(_socket.AF_UNIX, _socket.SOCK_STREAM)
    link.connect(sys.argv[1])
    handles = b"".join(n.to_bytes(4, sys.byteorder) for n in (0, 1, 2))
    link.sendmsg([len(told).to_bytes(4, "big")], [(_socket.SOL_SOCKET, _socket.SCM_RIGHTS, handles)])
    link.sendall(told)
    process = int.from_bytes(link.recv(4), "big")
    for number in (_signal.SIGINT, _signal.SIGTERM):
        _signal.signal(number, lambda number, frame: os.kill(process, number))
    code = int.from_bytes(link.recv(4), "big", signed=True)
    if code < 0:
        if -code != _signal.SIGKILL:
            _signal.signal(-code, _signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


main()
