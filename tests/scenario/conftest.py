"""Fixtures of the scenario tests: a registry of small plugins, and a parser of changed text."""

from __future__ import annotations

import textwrap

import pytest
from random_examples import SmallRandomInputs
from scenario_examples import GOOD, Parse, SmallPlugins

import wearsim.scenario.parse.mistakes
import wearsim.scenario.tables.plugin
from wearsim.plugins.manager import Registry
from wearsim.scenario import Scenario, parse_scenario


@pytest.fixture
def small_registry(monkeypatch: pytest.MonkeyPatch) -> Registry:
    registry = Registry([SmallPlugins(), SmallRandomInputs()])
    for module in (
        wearsim.scenario.tables.plugin,
        wearsim.scenario.parse.mistakes,
    ):
        monkeypatch.setattr(module, "registry", lambda: registry)
    return registry


@pytest.fixture
def parse(small_registry: Registry) -> Parse:
    """Parse the good scenario with parts of its text replaced."""

    def parse(
        *replace: tuple[str, str],
        files: dict[str, str] | None = None,
        overrides: dict[str, object] | None = None,
        text: str = GOOD,
    ) -> Scenario:
        for old, new in replace:
            assert old in text
            text = text.replace(old, textwrap.dedent(new))
        return parse_scenario(text, "rig.toml", (files or {}).__getitem__, overrides)

    return parse
