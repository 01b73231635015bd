"""A Python sidecar on TCP serves a new palpate although an old one, which vanished without a word, still has a connection.

Usage: tcp_sidecar.py FOLDER, the one of palpate_sidecar.py. Prints nothing; a wrong answer is an error.
"""
import contextlib
import json
import socket
import struct
import subprocess
import sys
import time

PROGRAM = f"""
import sys
sys.path.insert(0, {sys.argv[1]!r})
from palpate_sidecar import Sidecar
class Room(Sidecar):
    name = "room"
    sensors = [{{"name": "temperature", "unit": "C"}}]
    def sample(self):
        return {{"v": [21.5]}}
Room().run(["--tcp", "127.0.0.1:0"])
"""


def connect(port):
    """A connection that has said hello."""
    client = socket.create_connection(("127.0.0.1", port))
    client.sendall(b'{"n":1,"do":"hello","version":1}\n')
    return client


def is_served(client, patience):
    client.settimeout(patience)
    text = b""
    with contextlib.suppress(socket.timeout):
        while b'"sidecar":1' not in text:
            data = client.recv(4096)
            if not data:
                return False
            text += data
    return b'"sidecar":1' in text


def reset(client):
    """Ends a connection with a reset, as a computer does that has lost its program."""
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()


sidecar = subprocess.Popen([sys.executable, "-c", PROGRAM], stderr=subprocess.PIPE, text=True)
try:
    port = int(sidecar.stderr.readline().rsplit(":", 1)[1])
    # A reset before and after the first word, and while samples are sent.
    for word in (b"", b'{"n":1,"do":"hello","version":1}\n', b'{"n":1,"do":"hello","version":1}\n{"n":2,"do":"start"}\n'):
        client = socket.create_connection(("127.0.0.1", port))
        client.sendall(word)
        time.sleep(0.05)
        reset(client)
    old = connect(port)
    assert is_served(old, 300), "the first is not served"
    new = connect(port)
    assert is_served(new, 60), "the second is not served while the first is silent"
    # One that speaks is kept.
    longest, before = 0.0, time.monotonic()
    for number in range(2, 30):
        new.sendall(json.dumps({"n": number, "do": "beat"}).encode() + b"\n")
        time.sleep(0.1)
        longest, before = max(longest, time.monotonic() - before), time.monotonic()
    text = b""
    # Where this computer stood still for a second, the peer was silent indeed.
    while b'"ok":29' not in text and longest < 1.0:
        data = new.recv(4096)
        assert data, "a peer that speaks is sent away"
        text += data
finally:
    sidecar.kill()
