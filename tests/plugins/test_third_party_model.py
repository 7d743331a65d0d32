"""Third-party contact model without optional capabilities."""

from __future__ import annotations

import pytest
from plugin_examples import rig

import wearsim
from wearsim.errors import CapabilityError

FOUNDATION = 'model = "foundation"\nwidth = "8 mm"\nstrips = 81'

pytestmark = pytest.mark.usefixtures("tiny")


def foundation(overrides=None, **tables):
    return rig(overrides, **({"contact": FOUNDATION} | tables))


def test_single_contact_is_solved():
    solution = wearsim.solve_contact(foundation())
    spacing = solution.y[1] - solution.y[0]
    assert solution.line_load.sum() * spacing == pytest.approx(300.0, rel=1e-10)
    assert solution.power == pytest.approx(0.1 * 300.0 * 1e-3 * 2.618, rel=1e-4)


def test_auto_selects_stabilised_without_wear_compliance():
    result = wearsim.run(foundation())
    assert result.stepper == "stabilised"
    assert result.worn_volume[-1] == pytest.approx(
        1.1e-11 * result.dissipated_energy[-1], rel=1e-9, abs=0.0
    )


def test_stabilised_steps_agree_with_per_pass_steps():
    short = {"operation.duration": "12 s"}
    steps = wearsim.run(foundation(short))
    reference = wearsim.run(foundation(short | {"evolution.stepper": "per-pass"}))
    assert reference.stepper == "per-pass"
    assert int(reference.full_solves[-1]) == 600
    assert steps.depth[-1] == pytest.approx(float(reference.depth[-1]), rel=5e-3)
    assert steps.worn_volume[-1] == pytest.approx(
        float(reference.worn_volume[-1]), rel=5e-3, abs=0.0
    )


def test_rollers_that_differ_are_supported():
    offsets = {"roller.offset": ["-0.5 mm", "0 mm", "0.5 mm"]}
    result = wearsim.run(foundation(offsets))
    assert result.stepper == "stabilised"
    assert result.finished


@pytest.mark.parametrize("stepper", ["auto", "per-pass"])
def test_third_party_wear_law_and_load_term_run(stepper):
    scenario = foundation(
        {"evolution.stepper": stepper, "operation.duration": "12 s"},
        wear='law = "abrasion"\nfactor = 1e-15',
        load='normal_force = "300 N"\n[load.drift]\nrate = 1.0',
    )
    result = wearsim.run(scenario)
    # the load of each roller increases with dissipated energy: 0.0785 W for 12 s at 1 N/J
    assert result.normal_force[-1] == pytest.approx(300.0 + 0.0785 * 12.0, rel=1e-3)
    assert result.worn_volume[-1] == pytest.approx(
        600 * 1e-15 * 300.0 * 2 * 3.14159265 * 0.025, rel=5e-3
    )


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"evolution.stepper": "implicit"}, "takes no wear compliance"),
        ({"creepage.differential_slip": True}, "differential_slip"),
    ],
)
def test_missing_capability_is_refused_by_name(overrides, message):
    with pytest.raises(CapabilityError, match=f"'foundation'.*{message}"):
        wearsim.run(foundation(overrides))


def test_bearing_torque_is_refused():
    scenario = rig(contact=FOUNDATION).text.replace(
        "longitudinal = 1e-3", 'drive = "free"\nbearing_torque = "0.1 N m"'
    )
    parsed = wearsim.scenario.parse_scenario(scenario, "rig.toml", {}.__getitem__)
    with pytest.raises(CapabilityError, match="free"):
        wearsim.run(parsed)
