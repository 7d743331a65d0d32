"""Tests of the evolution, and helpers that build and step wear problems."""

from pathlib import Path

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import evolve
from wearsim.evolution.quantities import worn_volume
from wearsim.scenario import load_scenario
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def never(passes):
    """Return infinity: no record is due."""
    return float("inf")


def built(name="rig-450min", **changes):
    """Return problem, stepper and passes of a scenario; `__` in a key replaces a dot."""
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    scenario = load_scenario(SCENARIOS / f"{name}.toml", overrides=overrides)
    problem, stepper, _ = assemble_problem(draw(scenario))
    return problem, stepper, float(scenario.total_passes)


def stepped(problem, stepper, stop, state=None):
    """Return the state at `stop` passes and all steps."""
    state = state if state is not None else fresh_state(problem)
    advances = []
    for advance in evolve(problem, state, stepper, stop, never, 10**6):
        state = advance.end
        advances.append(advance)
    return state, advances


def worn(name="rig-450min", **changes):
    """Run a scenario and return its problem and end state."""
    problem, stepper, stop = built(name, **changes)
    return problem, stepped(problem, stepper, stop)[0]


def next_state(problem, stepper, state):
    """Return the state after one more step of a test without end."""
    return next(evolve(problem, state, stepper, 1e12, never, 10**6)).end


def cylinder_depth_of(state):
    """Return the greatest worn depth of the cylinder for each realisation."""
    return state.cylinder_depth.max(axis=(0, 1, 3))


def cylinder_volume_of(problem, state):
    """Return the cylinder's worn volume for each realisation, the mean over stations."""
    radius, spacing = problem.kinematics.cylinder_radius, problem.grid.spacing
    return worn_volume(state.cylinder_depth, spacing, radius).mean(axis=(0, 1))
