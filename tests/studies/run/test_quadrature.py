"""Quadrature over inputs that are drawn at every pass: true and stated errors."""

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS
from tests.studies.random_examples import scenario_of
from tests.studies.run.quadrature_study import errors as quadrature_errors, statistics
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import half_quadrature, volume_of
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw

EXACT = 2048  # nodes of the first pass
ADHESION, FULL_SLIP = 1e-4, 3e-3  # creepages of the rig


def drawn(kind: str, creepage: float, factor: float) -> dict[str, object]:
    """Return inputs that are drawn at every pass: one of them, or all together."""
    own = {"distribution": "lognormal", "factor": factor, "persistence": "per-pass"}
    load = {"distribution": "maxent", "support": ["0 N", "inf"], "mean": "307 N", "std": "60 N"}
    inputs = {
        "creepage": {"creepage__longitudinal": {**own, "median": creepage}},
        "friction": {"friction__coefficient": {**own, "median": 0.1}},
        "load": {"load__normal_force": {**load, "persistence": "per-pass"}},
    }
    chosen = inputs if kind == "all" else {kind: inputs[kind]}
    found = {"creepage__longitudinal": creepage, "operation__rollers": 1, "contact__strips": 61}
    for changes in chosen.values():
        found |= changes
    return found


def volumes(nodes: int, **inputs: object) -> tuple[float, float, float]:
    """Return the volume worn in a pass, that by half the nodes, and the part known to be wrong."""
    problem, _, _ = assemble_problem(draw(scenario_of(evolution__nodes=nodes, **inputs)))
    state, one = fresh_state(problem), np.ones(1)
    pairs = (problem, state), half_quadrature(problem, state)
    full, half = (float(volume_of(a, explicit_step(a, b, one).depths)[0]) for a, b in pairs)
    return full, half, problem.quadrature_error


def errors(nodes: int, **inputs: object) -> tuple[float, float]:
    """Return the true and the stated relative error of the volume worn in the first pass."""
    full, half, known = volumes(nodes, **inputs)
    exact = volumes(EXACT, **inputs)[0]
    return abs(full / exact - 1.0), abs(half / full - 1.0) + known


@pytest.mark.parametrize("nodes", [8, 16])
@pytest.mark.parametrize("kind", ["creepage", "friction"])
def test_partial_slip_is_integrated_within_the_stated_error(kind: str, nodes: int):
    true, stated = errors(nodes, **drawn(kind, ADHESION, 1.4))
    assert true < 2e-3
    assert true < stated


def test_full_slip_is_integrated_exactly():
    true, stated = errors(8, **drawn("creepage", FULL_SLIP, 1.1))
    assert true < 1e-7
    assert stated < 1e-4


@pytest.mark.slow
def test_stated_errors_of_the_quadrature_cover_the_true_ones():
    covered, ratio = statistics(*quadrature_errors(13, 20))
    assert covered >= 0.93
    assert ratio < 10.0


def test_stated_error_of_the_volume_has_the_scatter_of_the_draws():
    # at full slip wear is proportional to friction: the mean of 4000 draws scatters by 1/sqrt(4000)
    friction = {"distribution": "uniform", "low": 0.08, "high": 0.12, "persistence": "per-pass"}
    changes = {
        "operation.rollers": 1,
        "operation.duration": "4 min",
        "creepage.longitudinal": 0.02,
        "friction.coefficient": friction,
        "evolution.stepper": "implicit",
    }
    result = wearsim.run(wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes))
    relative = result.volume_error[-1] / result.worn_volume[-1]
    scatter = 0.2 / np.sqrt(3.0)  # standard deviation over the mean, of one draw
    assert relative == pytest.approx(2.0 * scatter / np.sqrt(4000.0), rel=0.1)
