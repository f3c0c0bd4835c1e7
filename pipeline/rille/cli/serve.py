"""``rille serve``: a live session in the browser and for programs."""

import contextlib
import gc
import os
import secrets
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.live_stage import live_scenario, live_stage
from rille.cli.talk import Json, print_json, say

if TYPE_CHECKING:
    import socket

LOOPBACK = ("127.0.0.1", "::1", "localhost")
SHORTEST_TOKEN = 16
BACKLOG = 128
REACH = 25.0  # [m] of ground around the start that is shown in full


def serve(
    database: Annotated[Path, typer.Argument(help="Database with the model.")],
    scenario: Annotated[str | None, typer.Option(help="Scenario file (TOML) or name; its commands are left out.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on; others than loopback need a token.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any that is free.")] = 8765,
    token_file: Annotated[
        Path | None,
        typer.Option(help="File with the token to be shown (or RILLE_TOKEN); made if it is not there."),
    ] = None,
    hooks: Annotated[Path | None, typer.Option(help="Python file of hooks on events, times and conditions.")] = None,
    step: Annotated[float | None, typer.Option(help="Time step [s] instead of the scenario's.")] = None,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    as_json: Json = False,
) -> int:
    """Drive the model live: watch, start, pause, reset, place, steer by keys, sliders and gamepad, from the page or by a remote API.

    Everything that is commanded is recorded; `rille run DATABASE --scenario live-1` repeats a session bit by bit. Ctrl-C ends it.

    Example: rille serve rover.db --scenario examples/first_drive/traverse.toml --open

    Example: rille serve rover.db --host 0.0.0.0 --token-file token.txt
    """
    import numpy as np

    from rille import live, store
    from rille.live.server import Show, make_app
    from rille.live.session import Session
    from rille.view import scene3d

    listening = _listening(host, port)
    token = _token(host, token_file)
    base = live_scenario(database, scenario, step)
    rover = store.read_rover(database)
    terrain = None if base.terrain is None else store.read_terrain(database, base.terrain)
    view = scene3d.view_of(terrain, np.array([base.start.position]), REACH)
    title = f"{database.stem}: {base.name}"
    layout = scene3d.layout(rover, view, title=title, gravity=scene3d.gravity_of(base))
    show = Show(page=scene3d.live_page(), scene=scene3d.scene_glb(rover, terrain, view), layout=layout)
    hooked = None if hooks is None else live.read_hooks(hooks, base.step, say)
    session = Session(live_stage(database, base, rover, view.origin), hooked)
    session.begin()
    hosts = None if host not in LOOPBACK else frozenset(LOOPBACK)
    app = make_app(session, show, token=token, hosts=hosts)
    try:
        return _serve(app, host, listening, token is not None, open_page, as_json)
    finally:
        session.close()


def _token(host: str, token_file: Path | None) -> str | None:
    """The token that must be shown; None on loopback without one."""
    from rille.model import InputRefused

    token = os.environ.get("RILLE_TOKEN") or None
    if token_file is not None:
        if not token_file.exists():
            try:
                with os.fdopen(os.open(token_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
                    file.write(secrets.token_urlsafe(32) + "\n")
            except OSError as error:
                raise InputRefused(f"the token file '{token_file}' cannot be made: {error.strerror}") from None
            say(f"a fresh token is in '{token_file}', readable by you alone")
        try:
            token = token_file.read_text().strip()
        except (OSError, UnicodeDecodeError) as error:
            raise InputRefused(f"the token file '{token_file}' cannot be read: {error}") from None
    if token is None and host not in LOOPBACK:
        raise InputRefused(f"whoever reaches {host} could command; give --token-file FILE (made if it is not there) or set RILLE_TOKEN")
    if token is not None and (len(token) < SHORTEST_TOKEN or not token.isascii() or not token.isprintable() or " " in token):
        raise InputRefused(f"the token must be {SHORTEST_TOKEN} or more printable characters without spaces; let --token-file make one")
    return token


def _collect_what_viewers_leave() -> None:
    """Garbage is looked for as often as Python does by itself, among what comes from now on alone: every connection that ends leaves cycles
    of 55 kB (buffers of its compression), which the rare collections of ``rille.cli.main`` let pile up for hours.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(700, 10, 10)


def _listening(host: str, port: int) -> "socket.socket":
    """A socket that listens on that address: who reads it and comes before the server is up waits.

    Raises
    ------
    InputRefused : if host is no address of this machine, or the port is taken or not allowed.
    """
    import errno
    import socket

    from rille.model import InputRefused

    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(BACKLOG)
    except OSError as error:
        listening.close()
        if isinstance(error, socket.gaierror) or error.errno == errno.EADDRNOTAVAIL:
            refused = f"'{host}' is no address of this machine: {error.strerror}; give --host 127.0.0.1, or 0.0.0.0 for all that it has"
            raise InputRefused(refused) from None
        raise InputRefused(f"{host}:{port} cannot be listened on: {error.strerror}; choose another --port, 0 for any") from None
    return listening


def _serve(app: Any, host: str, listening: "socket.socket", needs_token: bool, open_page: bool, as_json: bool) -> int:
    """Listen until Ctrl-C."""
    import uvicorn

    from rille.live.guard import MOST_BYTES

    port = listening.getsockname()[1]
    name = f"[{host}]" if ":" in host else host
    address = f"http://{name}:{port}/"
    if as_json:
        print_json({"address": address, "needs_token": needs_token})
    else:
        print(address + ("#token=..." if needs_token else ""))
    sys.stdout.flush()
    say("open this page; Ctrl-C ends the session" + ("; put the token in place of the dots" if needs_token else ""))
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws="websockets-sansio",
        ws_max_size=MOST_BYTES,
        server_header=False,
        timeout_graceful_shutdown=2,
    )
    if open_page:
        import webbrowser

        webbrowser.open(address)
    _collect_what_viewers_leave()
    server = uvicorn.Server(config)
    with contextlib.suppress(KeyboardInterrupt):  # which uvicorn raises again when it has ended in order
        server.run(sockets=[listening])
    if not server.started:
        return 1
    say("the session has ended; its runs are in the database")
    sys.stderr.flush()
    return 0
