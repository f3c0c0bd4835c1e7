"""A live session of a model, behind a real server on loopback."""

import socket
import threading
import time

import uvicorn

from rille import store
from rille.cli.live_stage import live_scenario, live_stage
from rille.live.client import Client
from rille.live.guard import MOST_BYTES
from rille.live.server import Show, make_app
from rille.live.session import Session

HOSTILE = "<img src=x onerror=alert(1)>"
FASTEST = 20.0  # [rad/s] of the first drive of the cart
PAGE = "<!doctype html><title>stub</title>"


class Live:
    """A server in a thread: address, session, database; ``client`` makes clients that are closed at the end."""

    def __init__(self, path, token=None, show=None):
        self.path = path
        base = live_scenario(path, None, None)
        show = show or Show(page=PAGE, scene=b"glTF", layout={"title": HOSTILE, "origin": [0, 0, 0]})
        self.session = Session(live_stage(path, base, store.read_rover(path), tuple(show.layout["origin"])))
        self.session.begin()
        app = make_app(self.session, show, token=token, hosts=frozenset({"127.0.0.1", "localhost"}))
        listening = socket.socket()
        listening.bind(("127.0.0.1", 0))
        self.port = listening.getsockname()[1]
        self.address = f"http://127.0.0.1:{self.port}"
        config = uvicorn.Config(app, log_level="warning", access_log=False, ws="websockets-sansio", ws_max_size=MOST_BYTES)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listening]}, daemon=True)
        self._thread.start()
        self._clients = []
        patience = time.monotonic() + 20
        while not self._server.started:
            assert self._thread.is_alive(), "the server ended"
            assert time.monotonic() < patience, "the server did not start"
            time.sleep(0.01)

    def client(self, sender="console", **options):
        client = Client(self.address, sender, **options)
        self._clients.append(client)
        return client

    def close(self):
        for client in self._clients:
            client.close()
        self._server.should_exit = True
        self._thread.join(20)
