"""Overrides: dotted keys over a scenario's text."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from scenario_examples import GOOD, Parse

from wearsim.errors import ScenarioError
from wearsim.scenario import parse_override
from wearsim.scenario.parse.overrides import apply_overrides


def test_override_changes_one_value_and_keeps_comments(parse: Parse) -> None:
    scenario = parse(overrides={"load.normal_force": "350 N"})
    assert scenario.load.options.normal_force == 350.0
    assert scenario.text == GOOD.replace("300 N", "350 N")


def test_overrides_reach_all_kinds_of_keys(parse: Parse) -> None:
    scenario = parse(
        overrides={
            "seed": 7,
            "wear.cylinder.k_over_h": "2e-11 1/Pa",
            "roller.offset": ["-1 mm", "0 mm", "1 mm"],
            "evolution.tolerance": 0.01,
            "load.thermal.gain": "3 N/W",
            "load.thermal.time_constant": "1 h",
        }
    )
    assert scenario.seed == 7
    assert scenario.wear.options.cylinder.k_over_h == 2e-11
    assert scenario.roller.offset == (-1e-3, 0.0, 1e-3)
    assert scenario.evolution.tolerance == 0.01
    assert scenario.load.terms[0].options.time_constant == 3600.0
    assert "# not the diameter" in scenario.text


def test_override_replaces_a_key_that_it_excludes(parse: Parse) -> None:
    scenario = parse(overrides={"operation.passes": 100, "roller.diameter": "30 mm"})
    assert (scenario.total_passes, scenario.operation.duration) == (100, None)
    assert scenario.roller.radius == 0.015


def test_two_exclusive_overrides_are_refused(parse: Parse) -> None:
    with pytest.raises(ScenarioError, match="exactly one is needed, got duration and passes"):
        parse(overrides={"operation.passes": 100, "operation.duration": "3 min"})


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            {"load.normal_forc": "3 N"},
            "rig.toml: [load] normal_forc: unknown key (did you mean 'normal_force'?)",
        ),
        (
            {"load.force": "300 N"},
            "rig.toml: [load] force: unknown key (did you mean 'normal_force'?)",
        ),
        ({"loda.x": 1}, "rig.toml: [loda]: unknown table (did you mean 'load'?)"),
        (
            {"roller.material.x": 3, "a..b": 1, "": 2, "seed": None},
            (
                "rig.toml: roller.material.x: cannot be set, since 'material' is not a table,"
                " got 3\n"
                "rig.toml: a..b: is not a key to override, got 1\n"
                "rig.toml: is not a key to override, got 2\n"
                "rig.toml: seed: has a value that TOML cannot hold, got None"
            ),
        ),
        (
            {"roller": "steel"},
            (
                'rig.toml: roller: is not a table, got "steel",'
                " expected a line [roller] and its keys below"
            ),
        ),
    ],
)
def test_invalid_override_is_a_mistake(
    parse: Parse, overrides: dict[str, object], message: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(overrides=overrides)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("load.normal_force=350 N", "load.normal_force", "350 N"),
        ('load.normal_force = "350 N"', "load.normal_force", "350 N"),
        ("contact.mx=50", "contact.mx", 50),
        ("evolution.tolerance=1e-4", "evolution.tolerance", 1e-4),
        ("creepage.differential_slip=true", "creepage.differential_slip", True),
        ('roller.offset=["1 mm", "2 mm"]', "roller.offset", ["1 mm", "2 mm"]),
        ("contact.model=slender", "contact.model", "slender"),
        ("title=a = b", "title", "a = b"),
    ],
)
def test_override_text_is_toml_or_plain_text(text: str, key: str, value: object) -> None:
    assert parse_override(text) == (key, value)


@pytest.mark.parametrize("text", ["seed", "=3", " = 3"])
def test_override_without_key_or_value_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not an override, expected key=value"):
        parse_override(text)


values = st.one_of(
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.booleans(),
    st.text(st.characters(codec="utf-8", exclude_characters="\r")),
    st.lists(st.integers(0, 9)),
)
keys = st.sampled_from(["seed", "load.normal_force", "wear.cylinder.k_over_h", "a.b.c", "new"])


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.dictionaries(keys, values, max_size=4))
def test_changed_text_holds_the_overrides(overrides: dict[str, object]) -> None:
    data = tomllib.loads(apply_overrides(GOOD, "rig.toml", overrides))
    for dotted, value in overrides.items():
        found = data
        for part in dotted.split("."):
            found = found[part]
        assert found == value
    assert data["friction"] == {"coefficient": 0.1}


@pytest.mark.parametrize(
    "text",
    [
        '[wear]\nlaw = "a"\ncylinder.k_over_h = "1 1/Pa"\nroller.k_over_h = "2 1/Pa"\n',
        'wear.law = "a"\nwear.cylinder.k_over_h = "1 1/Pa"\nwear.roller.k_over_h = "2 1/Pa"\n',
        '[wear]\nlaw = "a"\nroller.k_over_h = "2 1/Pa"\ncylinder.k_over_h.median = "1 1/Pa"\n',
    ],
)
@pytest.mark.parametrize("value", ["3 1/Pa", {"distribution": "lognormal", "median": "3 1/Pa"}])
def test_value_next_to_dotted_keys_is_replaced(text, value):
    changed = tomllib.loads(apply_overrides(text, "file", {"wear.cylinder.k_over_h": value}))
    roller = {"k_over_h": "2 1/Pa"}
    assert changed == {"wear": {"law": "a", "cylinder": {"k_over_h": value}, "roller": roller}}
