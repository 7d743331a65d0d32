"""Fixtures that install plugins next to the built-in ones for one test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import entry_points

import pytest
from plugin_examples import DATA, Point

from wearsim.plugins import manager

Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Return a function that installs made-up entry points next to those of wearsim only."""
    real = [
        point
        for point in entry_points(group=manager.PROJECT)
        if point.dist is not None and point.dist.name == "wearsim"
    ]

    def install(*points: Point) -> None:
        monkeypatch.setattr(manager, "entry_points", lambda group: [*real, *points])
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
