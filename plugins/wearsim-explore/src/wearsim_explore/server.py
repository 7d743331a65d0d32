"""Server of pages: on this machine only, with a token in the address."""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import threading
import warnings
from collections.abc import Callable
from html import escape
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.document import Document
from bokeh.server.auth_provider import AuthProvider
from bokeh.server.server import Server
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

import wearsim
from wearsim_explore.design import Design
from wearsim_explore.page import Page
from wearsim_explore.pool import Pool

LOCAL = "127.0.0.1"
_LIFETIME = 10_000  # ms that a session without a browser is kept
_FAREWELL = 0.2  # s, for the last message to the pages
_MOST_MESSAGE = 2**20  # bytes of a message from a browser


class _Token(AuthProvider):
    """Access by the token of the address; a websocket by the signed session of a page."""

    def __init__(self, token: str) -> None:
        self._token = token
        super().__init__()

    @property
    def get_user(self) -> Callable[[Any], Any]:
        """Function that returns a user for a request with the token, or None."""

        def user(handler: Any) -> str | None:
            # Bokeh opens a websocket only with a session that it has signed for a page
            if handler.request.path.endswith("/ws"):
                return "page"
            token = handler.get_query_argument("token", "")
            return "page" if hmac.compare_digest(token.encode(), self._token.encode()) else None

        return user

    @property
    def login_url(self) -> str:
        """Page that asks for the token."""
        return "/token"

    @property
    def login_handler(self) -> type[RequestHandler]:
        """Page that asks for the token; it keeps the state that a link carries."""

        class Ask(RequestHandler):
            def get(self) -> None:
                self.set_status(403)
                self.set_header("Referrer-Policy", "no-referrer")
                self.write(resources.files(__package__).joinpath("token.html").read_text("utf-8"))

        return Ask

    @property
    def get_user_async(self) -> None:
        return None

    @property
    def get_login_url(self) -> None:
        return None

    @property
    def logout_url(self) -> None:
        return None

    @property
    def logout_handler(self) -> None:
        return None


class Exploration:
    """A server of pages on one scenario.

    Parameters
    ----------
    design : Design
    host : str
        Address that is opened, by default that of this machine for itself.
    port : int
        Port; 0 for a free one.
    workers : int, optional
        Number of processes that compute tests.

    Attributes
    ----------
    port : int
        The port that is open.
    pages : list of Page
        The pages that are open.

    Raises
    ------
    OSError
        If the port is taken.
    """

    def __init__(
        self, design: Design, host: str = LOCAL, port: int = 0, workers: int | None = None
    ) -> None:
        self.design, self.host = design, host
        self.pages: list[Page] = []
        self._token = secrets.token_urlsafe(24)
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._error: OSError | None = None
        self._scratch = TemporaryDirectory(prefix="wearsim-explore-")
        self._thread = threading.Thread(target=self._serve, args=(port, workers), daemon=True)
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            self._scratch.cleanup()
            raise self._error

    @property
    def address(self) -> str:
        """Address of the page, with its token."""
        return f"http://{self._name}:{self.port}/?token={self._token}"

    @property
    def _name(self) -> str:
        if self.host in {"0.0.0.0", "::"}:
            import socket  # noqa: PLC0415

            return socket.getfqdn()
        return self.host

    def open(self) -> None:
        """Open the page in the browser."""
        import webbrowser  # noqa: PLC0415

        webbrowser.open(self.address)

    def wait(self) -> None:
        """Wait until the server is closed, from another thread or by an interrupt."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """End the server and its computations, and remove their files."""
        if self._thread.is_alive():
            asyncio.run_coroutine_threadsafe(self._end(), self._loop)
            self._thread.join()
        self._scratch.cleanup()

    def _repr_html_(self) -> str:
        """Return the page as a frame, for notebooks."""
        frame = 'style="width: 100%; height: 50rem; border: 1px solid #999"'
        title = f"Explore {escape(self.design.file.name)}"
        return f'<iframe src="{escape(self.address)}" title="{title}" {frame}></iframe>'

    def _serve(self, port: int, workers: int | None) -> None:
        """Serve pages in this thread until the server is closed."""
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._start(port, workers))
        except OSError as error:
            self._error = error
        self._ready.set()
        if self._error is None:
            self._loop.run_forever()
        self._loop.close()

    async def _start(self, port: int, workers: int | None) -> None:
        logging.getLogger("bokeh").setLevel(logging.ERROR)
        logging.getLogger("tornado.access").setLevel(logging.CRITICAL)
        self.pool = Pool(Path(self._scratch.name), workers)
        schema, count = wearsim.scenario_schema(), 0

        def fill(document: Document) -> None:
            nonlocal count
            count += 1
            name = f"page{count}"
            scratch = Path(self._scratch.name)
            page = Page(document, self.design, schema, self.pool, scratch, name)
            self.pages.append(page)
            document.on_session_destroyed(lambda _: self.pages.remove(page))

        self.port = _free_port(self.host, port)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._server = Server(
                {"/": Application(FunctionHandler(fill))},
                io_loop=IOLoop.current(),
                address=self.host,
                port=self.port,
                allow_websocket_origin=[f"{self._name}:{self.port}"],
                auth_provider=_Token(self._token),
                sign_sessions=True,
                secret_key=secrets.token_urlsafe(32).encode(),
                include_headers=[],
                include_cookies=[],
                unused_session_lifetime_milliseconds=_LIFETIME,
                check_unused_sessions_milliseconds=_LIFETIME // 2,
                websocket_max_message_size=_MOST_MESSAGE,
            )
        self._server.start()

    async def _end(self) -> None:
        for page in self.pages:
            page.document.add_next_tick_callback(page.end)
        if self.pages:
            await asyncio.sleep(_FAREWELL)
        self._server.stop()
        await self.pool.close()
        self._loop.stop()


def _free_port(host: str, port: int) -> int:
    """Return a port that is free at an address; OSError if the wanted one is not."""
    import socket  # noqa: PLC0415

    kind = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(kind) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        return int(probe.getsockname()[1])


def explore(scenario: Any) -> Exploration:
    """Return a server of pages on a scenario; parameters and errors as `wearsim.explore`."""
    return Exploration(design_of(scenario))


def design_of(scenario: Any, overrides: dict[str, object] | None = None) -> Design:
    """Return the design of a scenario or of its file.

    Parameters
    ----------
    scenario : Scenario or path
    overrides : dict of str to object, optional
        Values by dotted key.

    Raises
    ------
    ScenarioError
        If it has mistakes, or names files outside its folder.
    """
    if not isinstance(scenario, wearsim.Scenario):
        scenario = wearsim.load_scenario(scenario, overrides)
    design = Design(scenario.text, Path(scenario.file))
    design.scenario()  # refuses files outside the folder
    return design
