"""Fixtures that install plugins next to the built-in ones for one test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint, entry_points

import pytest
from plugin_examples import DATA, Point

from wearsim.plugins import manager

Install = Callable[..., None]


@pytest.fixture(scope="session")
def built_in() -> list[EntryPoint]:
    """Return the entry points of wearsim: to find them takes as long as a short test."""
    return [
        point
        for point in entry_points(group=manager.PROJECT)
        if point.dist is not None and point.dist.name == "wearsim"
    ]


@pytest.fixture
def install(built_in: list[EntryPoint], monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Return a function that installs made-up entry points next to those of wearsim only."""

    def install(*points: Point) -> None:
        monkeypatch.setattr(manager, "entry_points", lambda group: [*built_in, *points])
        manager.registry.cache_clear()

    yield install
    monkeypatch.undo()
    manager.registry.cache_clear()


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch, install: Install) -> None:
    """Install the third-party plugin of `data/tiny`."""
    monkeypatch.syspath_prepend(DATA / "tiny")

    def load():
        import wearsim_tiny

        return wearsim_tiny

    install(Point(load, "tiny", "wearsim-tiny", "1.2"))
