"""Names that users depend on are those of the listings in docs/stable."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from tests.stable_names import python_names, scenario_keys, stored

REMEDY = "stable names have changed, see docs/compatibility.md; python -m tests.stable_names"
PLUGINS = ("wearsim_optimise", "wearsim_halfspace")


def test_public_python_names_are_listed():
    assert python_names() == stored("python-names"), REMEDY


@pytest.mark.skipif(not all(map(find_spec, PLUGINS)), reason="they have tables of a scenario")
def test_keys_of_a_scenario_are_listed():
    assert scenario_keys() == stored("scenario-keys"), REMEDY
