"""The server of the app: on the loopback address alone, and for pages that it served itself."""

import logging
import signal
import socket
import webbrowser
from collections.abc import Awaitable, Callable, MutableMapping
from pathlib import Path
from threading import Timer
from typing import Any

import nicegui
import uvicorn
from fastapi import FastAPI

from wirebayes.app.folders import Shelf
from wirebayes.app.jobs import Jobs
from wirebayes.app.page import add_pages
from wirebayes.errors import InputError
from wirebayes.processes.workers import load_early

ADDRESS = "127.0.0.1"
PORT = 8137  # of no known service; another free one where it is taken and none was asked for
_PATIENCE_S = 1  # for open tabs, when the program ends

Message = MutableMapping[str, Any]
Send = Callable[[Message], Awaitable[None]]


def serve(folder: Path, port: int | None, *, seed: int, browse: bool) -> None:
    """Serve the app until Ctrl-C.

    Parameters
    ----------
    folder : Path
        Of the results.
    port : int or None
        Any free one where it is 0; 8137, or a free one, when left out.
    seed : int
        Of all fits.
    browse : bool
        Whether to open a page in the browser.

    Raises
    ------
    InputError
        The port is taken, or the folder cannot be written.
    """
    jobs = Jobs()
    listening = _bound(port)
    bound = listening.getsockname()[1]
    address = f"http://{ADDRESS}:{bound}/"
    load_early()  # from this thread, whose end would be that of the processes' parent
    add_pages(Shelf(folder), jobs, seed)
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    logging.getLogger("nicegui").setLevel(logging.ERROR)  # an address that does not exist is nobody's business
    nicegui.ui.run_with(application, title="wirebayes", dark=False, show_welcome_message=False)
    own = _Own(application, bound)
    config = uvicorn.Config(own, log_level="warning", timeout_graceful_shutdown=_PATIENCE_S, lifespan="on")
    server = uvicorn.Server(config)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # the server has its own handlers, and sends the signal again at its end
    print(f"wirebayes app: {address} (results in {folder}; Ctrl-C ends it)", flush=True)
    if browse:
        Timer(0.5, webbrowser.open, [address]).start()
    try:
        server.run(sockets=[listening])
    finally:
        jobs.stop_all()


def _bound(port: int | None) -> socket.socket:
    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    for tried in [PORT, 0] if port is None else [port]:
        try:
            listening.bind((ADDRESS, tried))
            return listening
        except (OSError, OverflowError) as error:
            reason = error
    raise InputError(f"--port: found {port}, which cannot be used ({reason}), expected a free port, or 0 for any")


class _Own:
    """Refuses what another page in the same browser, or a name that points here, asks for; forbids asking outside."""

    def __init__(self, application: Any, port: int) -> None:
        self._application = application
        self._hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
        sockets = " ".join(f"ws://{host}" for host in sorted(self._hosts))
        inline = "'self' 'unsafe-inline' 'unsafe-eval' data: blob:"  # pages of results have all they need inside
        self._policy = f"default-src {inline}; connect-src 'self' {sockets}".encode()

    async def __call__(self, scope: Message, receive: Any, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        origin = headers.get("origin")
        allowed = headers.get("host") in self._hosts and (origin is None or origin.partition("//")[2] in self._hosts)
        if not allowed:
            await _refuse(scope["type"], send)
            return

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), (b"content-security-policy", self._policy)]
            await send(message)

        await self._application(scope, receive, answer)


async def _refuse(kind: str, send: Send) -> None:
    if kind == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    await send({"type": "http.response.start", "status": 403, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": b"for pages of this program on this machine only\n"})
