"""Server times of `wearsim explore`: ``python -m tests.benchmarks.exploring -o FILE.json``.

A move is a change of one value, as a slider sends it; the next move follows its first answer. Its
time is that from the receipt of the change to the answer in the document. Each page has a websocket
that receives what a browser would.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from urllib.request import urlopen

import numpy as np
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from tests.benchmarks.table import Effort, Row, markdown, save_tables
from wearsim_explore.page import Page
from wearsim_explore.server import Exploration, design_of

TITLE = "Exploring a scenario"
MOVES, PAGES = 200, 10
_PATIENCE = 300.0  # s
RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"


@contextmanager
def pages(server: Exploration, count: int) -> Iterator[list[Page]]:
    """Open pages with a websocket each, and close them at the end."""
    texts = [urlopen(server.address).read().decode() for _ in range(count)]
    tokens = [re.search(r'"token":"([^"]+)"', text)[1] for text in texts]  # type: ignore[index]
    loop = asyncio.new_event_loop()

    async def read(token: str) -> None:
        origin = {"Origin": f"http://127.0.0.1:{server.port}"}
        request = HTTPRequest(f"ws://127.0.0.1:{server.port}/ws", headers=origin)
        connection = await websocket_connect(request, subprotocols=["bokeh", token])
        while await connection.read_message() is not None:
            pass

    tasks = [loop.create_task(read(token)) for token in tokens]
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        opened = server.pages[-count:]
        wait_until(lambda: all(page.finals for page in opened))  # kernels are warm then
        yield opened
    finally:
        for task in tasks:
            loop.call_soon_threadsafe(task.cancel)
        loop.call_soon_threadsafe(loop.call_later, 0.2, loop.stop)
        thread.join()
        loop.close()


def wait_until(condition: object) -> None:
    """Wait until a condition holds; raises TimeoutError if it does not."""
    end = time.monotonic() + _PATIENCE
    while not condition():  # type: ignore[operator]
        if time.monotonic() > end:
            raise TimeoutError("no answer")
        time.sleep(1e-3)


def moved(page: Page, moves: int) -> list[float]:
    """Return the server times of moves, each after the answer to the one before [s]."""
    times = []
    for radius in np.linspace(400.0, 600.0, moves):
        before = len(page.server_times)
        change = {"key": "roller.crown_radius", "value": f"{radius:.4g}", "begins": False}
        page.document.add_next_tick_callback(
            partial(page.act, "change", **change, held=True, slides=True)
        )
        wait_until(lambda: len(page.server_times) > before)  # noqa: B023  (called at once)
        times.append(page.server_times[-1])
    return times


def server_times(effort: Effort, count: int) -> list[float]:
    """Return the server times of moves on several pages at once [s]."""
    moves = max(2, round(MOVES * effort.part / count))
    server = Exploration(design_of(RIG))
    found: list[list[float]] = []
    try:
        with pages(server, count) as opened:
            threads = [
                threading.Thread(target=lambda page=page: found.append(moved(page, moves)))
                for page in opened
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
    finally:
        server.close()
    return [one for times in found for one in times]


def exploring_rows(effort: Effort) -> list[Row]:
    """Return median and 95 % of the server times, of one page and of several at once."""
    alone, several = server_times(effort, 1), server_times(effort, PAGES)
    return [
        Row(f"one page, {len(alone)} moves: median", float(np.median(alone)), "50 ms"),
        Row("95 % of them within", float(np.quantile(alone, 0.95)), "100 ms"),
        Row(f"{PAGES} pages at once, {len(several)} moves: median", float(np.median(several)), ""),
        Row("95 % of them within", float(np.quantile(several, 0.95)), "500 ms"),
    ]


def main(arguments: list[str] | None = None) -> None:
    """Write the table to a file."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.exploring", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json", required=True)
    parser.add_argument("--quick", action="store_true", help="few moves")
    options = parser.parse_args(arguments)
    rows = exploring_rows(Effort(part=0.05 if options.quick else 1.0))
    tables = {TITLE: markdown(TITLE, rows)}
    save_tables(options.output, "python -m tests.benchmarks.exploring", tables)


if __name__ == "__main__":
    main()
