"""Who may come in, what they may bring, and what they find."""

import contextlib
import json
import socket
import struct
import time
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from browser import until
from live_server import HOSTILE, PAGE
from rille.live.client import Client
from rille.live.history import SPACING
from rille.model import InputRefused

TOKEN = "correct-horse-battery"


def ask(address, path="/api/status", method="GET", body=None, **headers):
    """(status, body) of an HTTP request; headers with _ for -."""
    request = urllib.request.Request(address + path, data=body, method=method, headers={k.replace("_", "-"): v for k, v in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=10) as response:
            return response.status, response.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def test_the_api_describes_itself_and_obeys_over_rest(live):
    status, text = ask(live.address, "/openapi.json")
    described = json.loads(text)
    assert status == 200
    assert set(described["paths"]) == {
        "/scene.glb",
        "/api/layout",
        "/api/history",
        "/api/status",
        "/api/objects",
        "/api/objects/{quantity}/{target}",
        "/api/commands",
    }
    assert "Steer" in described["components"]["schemas"]

    def command(**values):
        body = json.dumps({"sender": "rest", **values}).encode()
        return ask(live.address, "/api/commands", "POST", body, Content_Type="application/json")

    assert command(sequence=1, kind="take")[0] == 200
    assert json.loads(command(sequence=2, kind="step", count=20)[1])["accepted"]
    refused = json.loads(command(sequence=2, kind="pause")[1])
    assert (refused["accepted"], refused["sequence"]) == (False, 2)
    assert "came before" in refused["sentence"]
    code, text = command(sequence=3, kind="speed", factor=-1)
    assert code == 422
    assert "malformed at 'factor'" in json.loads(text)["sentence"]
    code, text = ask(live.address, "/api/objects/wheel.sinkage/nowhere")
    assert code == 404
    assert "does not have" in json.loads(text)["sentence"]
    names = json.loads(ask(live.address, "/api/objects")[1])
    assert {"quantity": "part.position", "target": HOSTILE, "unit": "m", "components": ["x", "y", "z"], "writable": True} in names


def test_who_comes_late_finds_the_run_so_far(live):
    """Frames in the order of time up to now, and none of a run that was given up."""

    def times():
        said = ask(live.address, "/api/history")[1]
        length = 16 + first.frame.nbytes
        assert len(said) % length == 0
        return [struct.unpack_from("<IId", said, at)[2] for at in range(0, len(said), length)]

    with Client(live.address, sender="first") as first:
        first.take()
        first.ask("start")
        until(lambda: first.time > 0.5, "half a second")
        first.ask("pause")
        found = times()
        assert found[0] == 0.0
        assert found[-1] > 0.5 - 2 * SPACING
        assert 3 <= len(found) <= 1 + found[-1] / (0.99 * SPACING)
        assert found == sorted(set(found))
        first.ask("reset")
        until(lambda: times() == [0.0], "another run")


def test_without_the_token_nothing_of_the_model_is_seen(guarded):
    assert ask(guarded.address, "/") == (200, PAGE.encode())  # the page itself holds nothing
    for path in ("/api/status", "/api/layout", "/api/history", "/scene.glb", "/openapi.json", "/api/objects", "/api/nothing"):
        code, text = ask(guarded.address, path)
        assert (code, json.loads(text)["accepted"]) == (401, False), path
        assert ask(guarded.address, path, Authorization="Bearer wrong-token-wrong-token")[0] == 401
        assert ask(guarded.address, path + f"?token={TOKEN}")[0] == 401  # never in an address, which is logged on the way
    assert ask(guarded.address, Authorization=f"Bearer {TOKEN}")[0] == 200
    with pytest.raises(InputRefused, match="token is missing or wrong"):
        Client(guarded.address, "thief")
    with pytest.raises(InputRefused, match="token is missing or wrong"):
        Client(guarded.address, "thief", token=TOKEN[:-1])
    guarded.client("friend", token=TOKEN).take()


def test_the_token_is_never_written(guarded, capfd):
    guarded.client("friend", token=TOKEN).take()
    ask(guarded.address, Authorization="Bearer " + TOKEN[::-1])
    guarded.close()
    out, err = capfd.readouterr()
    assert TOKEN not in out + err
    assert TOKEN.encode() not in guarded.path.read_bytes()


def test_pages_of_others_are_refused(live):
    """A browser lets any page talk to loopback: neither its origin nor a name that was rebound to 127.0.0.1 comes in."""
    assert ask(live.address, Origin="http://evil.example")[0] == 403
    assert ask(live.address, Origin="null")[0] == 403
    assert ask(live.address, Host="evil.example")[0] == 421
    assert ask(live.address, Origin=live.address)[0] == 200
    with (
        pytest.raises((InvalidStatus, ConnectionClosed)),
        connect(live.address.replace("http", "ws") + "/api/stream", origin="http://evil.example") as socket_,
    ):
        socket_.recv()


@pytest.mark.parametrize("header", [{"Host": "["}, {"Host": "[1]x"}, {"Origin": "http://["}])
def test_a_malformed_name_of_caller_or_called_is_refused_in_a_sentence(live, header):
    code, text = ask(live.address, **header)
    assert code == 400
    assert "'Host' or 'Origin' is malformed" in json.loads(text)["sentence"]


@pytest.mark.parametrize(
    "path",
    [
        "/../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/scene.glb/../../pyproject.toml",
        "//etc/passwd",
        "/static/..%2f..%2fetc%2fpasswd",
    ],
)
def test_there_are_no_files_behind_the_server(live, path):
    with socket.create_connection(("127.0.0.1", live.port), timeout=10) as raw:
        raw.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{live.port}\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: raw.recv(65536), b""))
    assert answer.split()[1] == b"404", answer[:200]
    assert b"root:" not in answer


def test_a_name_cannot_be_a_path_or_a_script(live):
    rover = live.client()
    rover.take()
    for name in ("../../x", "a/b", "<script>", "", "x" * 65, "a\nb"):
        with pytest.raises(InputRefused, match="malformed at 'name'"):
            rover.save(name)
    rover.save("a state 1.2-b")


def test_what_is_too_long_is_refused_and_others_go_on(live):
    code, text = ask(live.address, "/api/commands", "POST", b" " * 100_000, Content_Type="application/json")
    assert code == 413
    assert "65536 bytes" in json.loads(text)["sentence"]
    watcher = live.client("watcher")
    with connect(live.address.replace("http", "ws") + "/api/stream") as huge:
        huge.send(json.dumps({"kind": "hello", "sender": "huge"}))
        huge.send("x" * 200_000)
        with pytest.raises(ConnectionClosed):  # noqa: PT012
            for _ in range(1000):
                huge.recv(timeout=10)
    watcher.take()


def test_the_first_message_must_be_a_greeting(live):
    for first in ("{}", "hello", '{"kind": "hello", "sender": ""}', '{"kind": "take", "sender": "a", "sequence": 1}'):
        with connect(live.address.replace("http", "ws") + "/api/stream") as rude:
            rude.send(first)
            with pytest.raises(ConnectionClosed) as closed:
                rude.recv(timeout=10)
            assert closed.value.rcvd.code == 4400


def test_one_who_does_not_read_holds_up_nobody(live):
    """A viewer that never takes a byte: the session keeps its pace, the others their frames, and what waits for it is bounded."""
    rover = live.client()
    rover.take()
    address = live.address.replace("http", "ws") + "/api/stream"
    with contextlib.ExitStack() as stack:
        for _ in range(3):
            sleeper = stack.enter_context(connect(address, max_queue=1))
            sleeper.send(json.dumps({"kind": "hello", "sender": "sleeper"}))
        rover.start()
        time.sleep(1.0)
        began, wall, frames = rover.time, time.monotonic(), rover.frames
        for _ in range(50):
            rover.steer(0.1)
        time.sleep(max(0.0, 1.0 - (time.monotonic() - wall)))
        wall = time.monotonic() - wall
        assert rover.time - began > 0.5 * wall  # of real time; a session that waited would stand
        assert rover.frames - frames > 10 * wall


def test_a_page_of_many_hands_is_bounded(live):
    from rille.live import server

    rover = live.client()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server, "MOST_VIEWERS", 2)
        live.client("second")
        with pytest.raises(InputRefused, match="2 viewers are here already"):
            live.client("third")
    rover.take()
