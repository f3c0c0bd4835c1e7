"""The server of a live session: the page, REST and a WebSocket. ``README.md`` beside this file describes the messages."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import Body, FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rille.live.guard import WRONG_TOKEN_PAUSE, Guard, same_token
from rille.live.hub import Hub, Viewer
from rille.live.request import Answer, AnyRequest, complaint
from rille.live.session import Session
from rille.model import InputRefused

MOST_VIEWERS = 200
HELLO_WITHIN = 5.0  # [s] of real time
STATUS_EVERY = 1.0  # [s] of real time
ABOUT = (
    "Steer a live session of rille. Requests carry sender, sequence (rising for each sender) and time (simulated time [s] at which they "
    "act; none: now). Only the sender that has the command is obeyed. The WebSocket /api/stream takes the same requests as text, after a "
    'first message {"kind": "hello", "sender": "...", "token": null}, and sends status, events, answers (text) and frames (binary: uint32 '
    "magic 0x52494C4C, uint32 number, float64 time, float32 values in the order of /api/layout, little endian)."
)


class Hello(BaseModel):
    """The first message of a WebSocket."""

    model_config = ConfigDict(extra="forbid")
    kind: Literal["hello"]
    sender: Annotated[str, Field(min_length=1, max_length=64)]
    token: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Show:
    """What viewers are given: the page (HTML), the scene (glb) and the layout of frames."""

    page: str
    scene: bytes
    layout: dict[str, Any]


def make_app(session: Session, show: Show, *, token: str | None = None, hosts: frozenset[str] | None = None) -> FastAPI:
    """The application, of a session that has begun. token : of whoever comes; None: not needed. hosts : its own names; None: any."""

    @contextlib.asynccontextmanager
    async def life(app: FastAPI) -> AsyncIterator[None]:
        app.state.hub = hub = Hub(session)
        session.refresh()
        ticking = asyncio.create_task(_tick(hub))
        yield
        ticking.cancel()
        await asyncio.to_thread(session.close)

    app = FastAPI(title="rille serve", description=ABOUT, docs_url=None, redoc_url=None, lifespan=life)
    app.add_middleware(Guard, token=token, hosts=hosts)

    @app.exception_handler(RequestValidationError)
    async def malformed(request: Request, error: RequestValidationError) -> Response:
        with contextlib.suppress(TypeError, ValueError):
            session.ask(json.dumps(error.body))  # so that it is in the log as those of the WebSocket are
        return JSONResponse({"accepted": False, "sentence": complaint(list(error.errors()))}, 422)

    @app.exception_handler(InputRefused)
    async def refused(request: Request, error: InputRefused) -> Response:
        return JSONResponse({"accepted": False, "sentence": str(error)}, 404)

    @app.get("/", response_class=HTMLResponse, include_in_schema=False)
    async def page() -> str:
        return show.page

    @app.get("/favicon.ico", include_in_schema=False)
    async def icon() -> Response:
        return Response(status_code=204)

    @app.get("/scene.glb", summary="Meshes of machine and ground, binary glTF")
    async def scene() -> Response:
        return Response(show.scene, media_type="model/gltf-binary")

    @app.get("/api/layout", summary="Names and order of the numbers in a frame")
    async def layout() -> dict[str, Any]:
        return show.layout

    @app.get("/api/status", summary="How the session stands")
    async def status() -> dict[str, Any]:
        return app.state.hub.status(session.status())

    @app.get(
        "/api/history",
        summary="The run so far: frames as the stream sends them, one after the other, fewer to the second the longer it lasts",
    )
    async def history() -> Response:
        return Response(app.state.hub.history.frames(), media_type="application/octet-stream")

    @app.get("/api/objects", summary="Everything that can be read or set, by quantity and target")
    async def objects() -> list[dict[str, Any]]:
        return list(session.stage.objects)

    @app.get("/api/objects/{quantity}/{target}", summary="Numbers of a quantity as of now [SI, in W]")
    async def read(quantity: str, target: str) -> dict[str, Any]:
        values = await asyncio.wrap_future(session.call(lambda simulation: (simulation.time, simulation.read(quantity, target))))
        return {"quantity": quantity, "target": target, "time": values[0], "values": list(values[1])}

    @app.post("/api/commands", summary="Ask for something")
    async def ask(request: Annotated[AnyRequest, Body()]) -> Answer:
        return await asyncio.wrap_future(session.ask(request))

    @app.websocket("/api/stream")
    async def stream(socket: WebSocket) -> None:
        await _stream(socket, app.state.hub, token)

    return app


async def _tick(hub: Hub) -> None:
    while True:
        await asyncio.sleep(STATUS_EVERY)
        hub.tell_status()


async def _stream(socket: WebSocket, hub: Hub, token: str | None) -> None:
    await socket.accept()
    sender = await _hello(socket, hub, token)
    if sender is None:
        return
    viewer = hub.join(sender)
    sending = asyncio.create_task(_send(socket, hub, viewer))
    try:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                break
            text = message.get("text")
            answer = await asyncio.wrap_future(hub.session.ask(text if text is not None else message.get("bytes") or b"", sender))
            viewer.texts.append(answer.model_dump_json())
            viewer.woken.set()
    except (WebSocketDisconnect, RuntimeError):
        pass  # the viewer is gone
    finally:
        sending.cancel()
        hub.leave(viewer)


async def _hello(socket: WebSocket, hub: Hub, token: str | None) -> str | None:
    """The sender's name, once it has shown the token; else the connection is closed with a sentence."""
    try:
        hello = Hello.model_validate_json(await asyncio.wait_for(socket.receive_text(), HELLO_WITHIN))
    except (TimeoutError, WebSocketDisconnect, ValidationError, KeyError, RuntimeError):
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close(4400, 'the first message must be {"kind": "hello", "sender": "..."}')
        return None
    if not same_token(hello.token, token):
        await asyncio.sleep(WRONG_TOKEN_PAUSE)
        await socket.close(4401, "the token is missing or wrong")
        return None
    if len(hub.viewers) >= MOST_VIEWERS:
        await socket.close(4429, f"{MOST_VIEWERS} viewers are here already")
        return None
    return hello.sender


async def _send(socket: WebSocket, hub: Hub, viewer: Viewer) -> None:
    """What waits for one viewer, as fast as it takes it."""
    try:
        while True:
            await viewer.woken.wait()
            viewer.woken.clear()
            while viewer.texts:
                await socket.send_text(viewer.texts.popleft())
            if viewer.seen != hub.number and hub.frame:
                viewer.seen = hub.number
                await socket.send_bytes(hub.frame)
    except (WebSocketDisconnect, RuntimeError):
        pass  # the receiving side notices, too
