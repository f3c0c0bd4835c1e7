"""A live server that speaks the protocol and simulates nothing but a rover on a plane way: what it is told is kept for the test to read."""

import asyncio
import contextlib
import json
import socket
import struct
import threading
from collections.abc import Iterator

import uvicorn
from fastapi import FastAPI, HTTPException, Response, WebSocket, WebSocketDisconnect

from web.assembled import page
from web.made_scene import ORIGIN, SPEED, layout, scene, state_at


class Fake:
    """commands : all that came, in order. refuse : kind -> sentence. saved : time and x of the state that is loaded. fails : quantities
    that cannot be read."""

    def __init__(self) -> None:
        self.commands: list[dict] = []
        self.refuse: dict[str, str] = {}
        self.state, self.time, self.commander, self.asked_by, self.number = "ready", 0.0, None, None, 0
        self.x, self.y, self.yaw, self.steer = -1.6, -0.4, 0.35, (0.0, 0.0)
        self.run_id, self.saved, self.speed = 3, (50.0, 2.5), 1.0
        self.layout, self.fails = layout(), set[str]()
        self.sockets: list[WebSocket] = []
        self.port = 0
        self.set_values: list[float] = []
        self.answers_after = 0.0  # s; before it answers, it tells its status as it was
        self.rejects: tuple[int, str] | None = None  # code and reason with which a connection is closed
        self.connections = 0
        self.history: list[bytes] = []  # frames of the run so far

    def of(self, kind: str) -> list[dict]:
        return [command for command in self.commands if command["kind"] == kind]

    def status(self) -> dict:
        return {
            "kind": "status", "state": self.state, "time": self.time, "speed": self.speed, "commander": self.commander,
            "asked_by": self.asked_by, "viewers": len(self.sockets), "scenario": "live-1", "run_id": self.run_id,
            "outcome": "running", "message": "", "saves": ["before"], "set_values": self.set_values,
        }  # fmt: skip

    def obey(self, command: dict) -> str:
        """Why not, or nothing."""
        self.commands.append(command)
        kind, sender = command["kind"], command["sender"]
        if kind in self.refuse:
            return self.refuse[kind]
        if kind == "take":
            if self.commander not in (None, sender):
                self.asked_by = sender
                return f"'{self.commander}' commands"
            self.commander = sender
        elif self.commander != sender:
            return f"'{sender}' does not command"
        elif kind == "release":
            self.commander = None
        elif kind == "hand_over":
            self.commander, self.asked_by = command["to"], None
        elif kind in ("start", "pause"):
            self.state = "running" if kind == "start" else "paused"
        elif kind == "place":
            self.x, self.y = command["x"] - ORIGIN[0], command["y"] - ORIGIN[1]
            self.yaw = self.yaw if command["heading"] is None else command["heading"]
        elif kind == "steer":
            self.steer = (command["forward"], command["turn"])
        elif kind == "reset":
            self.x, self.y, self.yaw, self.time, self.state = -1.6, -0.4, 0.35, 0.0, "ready"
            self.run_id += 1
        elif kind == "load":
            self.run_id += 1
            (self.time, self.x), self.state = self.saved, "paused"
        elif kind == "speed":
            self.speed = command["factor"]
        return ""

    def move(self, dt: float) -> None:
        if self.state == "running":
            import math

            self.time += dt
            self.yaw += self.steer[1] * dt
            self.x += self.steer[0] * math.cos(self.yaw) * dt
            self.y += self.steer[0] * math.sin(self.yaw) * dt

    def frame(self) -> bytes:
        self.number += 1
        slip = 0.25 if self.steer[0] else 0.0
        state = state_at(self.x, self.y, self.yaw, self.time * SPEED / 0.15, slip, 0.5 * self.time)
        return struct.pack("<IId", 0x52494C4C, self.number, self.time) + state.tobytes()

    async def say(self, message: dict) -> None:
        for viewer in list(self.sockets):
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await viewer.send_text(json.dumps(message))


def _app(fake: Fake) -> FastAPI:
    @contextlib.asynccontextmanager
    async def life(app: FastAPI):
        ticking = asyncio.create_task(tick())
        yield
        ticking.cancel()

    async def tick() -> None:
        count = 0
        while True:
            await asyncio.sleep(1 / 30)
            fake.move(1 / 30)
            count += 1
            frame = fake.frame()
            for viewer in list(fake.sockets):
                with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                    await viewer.send_bytes(frame)
            if count % 30 == 0:
                await fake.say(fake.status())

    app = FastAPI(lifespan=life)
    html, glb = page({"kind": "live"}, "live"), scene()

    @app.get("/")
    async def _page() -> Response:
        return Response(html, media_type="text/html")

    @app.get("/scene.glb")
    async def _scene() -> Response:
        return Response(glb, media_type="model/gltf-binary")

    @app.get("/api/layout")
    async def _layout() -> dict:
        return fake.layout

    @app.get("/api/history")
    async def _history() -> Response:
        return Response(b"".join(fake.history), media_type="application/octet-stream")

    @app.get("/api/objects")
    async def _objects() -> list[dict]:
        return [
            {"quantity": "position", "target": "chassis", "unit": "m", "components": ["x", "y", "z"], "writable": True},
            {"quantity": "sinkage", "target": "wheel_front_left", "unit": "m", "components": [], "writable": False},
        ]

    @app.get("/api/objects/{quantity}/{target}")
    async def _read(quantity: str, target: str) -> dict:
        if quantity in fake.fails:
            raise HTTPException(404, "it cannot be read now")
        return {"values": [fake.x + ORIGIN[0], fake.y + ORIGIN[1], 20.3] if quantity == "position" else [0.0314]}

    @app.websocket("/api/stream")
    async def _stream(viewer: WebSocket) -> None:
        await viewer.accept()
        fake.connections += 1
        json.loads(await viewer.receive_text())
        if fake.rejects is not None:
            await viewer.close(*fake.rejects)
            return
        fake.sockets.append(viewer)
        await fake.say(fake.status())
        try:
            while True:
                command = json.loads(await viewer.receive_text())
                if fake.answers_after:
                    await fake.say(fake.status())
                    await asyncio.sleep(fake.answers_after)
                why = fake.obey(command)
                if command["kind"] == "load":
                    await fake.say({"kind": "event", "time": fake.time, "event": "contact", "subject": "of the loaded run", "message": ""})
                answer = {"kind": "answer", "sequence": command["sequence"], "accepted": not why, "time": fake.time, "sentence": why}
                await viewer.send_text(json.dumps(answer))
                await fake.say(fake.status())
        except (WebSocketDisconnect, RuntimeError):
            fake.sockets.remove(viewer)

    return app


@contextlib.contextmanager
def served(fake: Fake, port: int = 0) -> Iterator[str]:
    """The server's address, as long as the block lasts."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("127.0.0.1", port))
    listener.listen()  # whoever comes before the server is up, waits
    fake.port = listener.getsockname()[1]
    server = uvicorn.Server(uvicorn.Config(_app(fake), log_level="error", timeout_graceful_shutdown=1, ws="websockets-sansio"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{fake.port}/"
    finally:
        server.should_exit = True
        thread.join(5)
        listener.close()
