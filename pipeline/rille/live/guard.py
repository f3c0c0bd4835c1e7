"""What stands before every request to the server: who may come in, from where, and how much they may bring."""

import asyncio
import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import urlsplit

MOST_BYTES = 65_536  # of a request or a message
WRONG_TOKEN_PAUSE = 0.3  # [s] before a wrong token is refused
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"content-security-policy", b"frame-ancestors 'none'"),
    (b"cache-control", b"no-store"),
)
OPEN = {"/", "/favicon.ico"}  # the page holds nothing of the model, and tells the token in its first message
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]


def same_token(given: str | None, token: str | None) -> bool:
    """Whether the token is right, in a time that does not tell how much of it is; always where none is needed."""
    return token is None or (given is not None and hmac.compare_digest(given.encode(), token.encode()))


class Guard:
    """ASGI middleware.

    hosts : names and addresses under which the server may be called (against DNS rebinding); None: any, which needs a token.
    Pages of other origins are refused, since a browser would let them talk to loopback. token : of all but the page itself.
    """

    def __init__(self, app: Any, *, token: str | None, hosts: frozenset[str] | None) -> None:
        self._app, self._token, self._hosts = app, token, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {key.decode("latin-1").lower(): value.decode("latin-1") for key, value in scope["headers"]}
        refused = self._refused(scope, headers)
        if refused is not None:
            if refused[0] == 401:
                await asyncio.sleep(WRONG_TOKEN_PAUSE)
            await _refuse(scope, receive, send, *refused)
            return
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return
        body = await _body(receive)
        if body is None:
            await _refuse(scope, receive, send, 413, f"a request may have {MOST_BYTES} bytes at most")
            return
        given = False

        async def once() -> MutableMapping[str, Any]:
            nonlocal given
            if given:
                return await receive()
            given = True
            return {"type": "http.request", "body": body, "more_body": False}

        async def safe(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *HEADERS]
            await send(message)

        await self._app(scope, once, safe)

    def _refused(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        host, origin = headers.get("host", ""), headers.get("origin")
        try:
            called, comes_from = urlsplit(f"//{host}").hostname or "", None if origin is None else urlsplit(origin).netloc
        except ValueError:
            return (
                400,
                "the header 'Host' or 'Origin' is malformed; each names a server, such as 'localhost:8000' and 'http://localhost:8000'",
            )
        if self._hosts is not None and called not in self._hosts:
            return 421, "this server was not called by a name of its own"
        if comes_from is not None and comes_from != host:
            return 403, "pages of other origins may not talk to this server"
        if self._token is None or scope["type"] == "websocket" or scope["path"] in OPEN:
            return None  # a WebSocket brings its token in its first message
        scheme, _, given = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and same_token(given.strip(), self._token):
            return None
        return 401, "the token is missing or wrong; send the header 'Authorization: Bearer TOKEN'"


async def _body(receive: Receive) -> bytes | None:
    """The body of a request; None if it is too long."""
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return bytes(body)
        body += message.get("body", b"")
        if len(body) > MOST_BYTES:
            return None
        if not message.get("more_body", False):
            return bytes(body)


async def _refuse(scope: Scope, receive: Receive, send: Send, code: int, sentence: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 4000 + code, "reason": sentence})
        return
    import json

    content = json.dumps({"accepted": False, "sentence": sentence}).encode()
    start = {"type": "http.response.start", "status": code, "headers": [(b"content-type", b"application/json"), *HEADERS]}
    await send(start)
    await send({"type": "http.response.body", "body": content})
