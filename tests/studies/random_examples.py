"""Scenarios of short, fast-wearing tests with random inputs."""

from pathlib import Path

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import evolve
from wearsim.scenario import load_scenario
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
LOAD = {"distribution": "maxent", "support": ["0 N", "inf"], "mean": "307 N", "std": "32 N"}
FRICTION = {"distribution": "maxent", "support": [0, "inf"], "mean": 0.1, "std": 0.02}
CREEPAGE = {"distribution": "maxent", "support": [0, 1], "mean": 1e-3, "std": 4e-4}
SLACK = {"distribution": "disc", "radius": "2 mrad"}
WANDERING = {"distribution": "ornstein-uhlenbeck", "correlation_time": "20 s"}
FAST = "2e-9 1/Pa"  # two hundred times the rig's


def scenario_of(passes=6000, k_over_h=FAST, **changes):
    """Return the rig with a fast-wearing cylinder; `__` in a name is the dot of a key."""
    overrides = {"operation.passes": passes, "wear.cylinder.k_over_h": k_over_h}
    overrides |= {key.replace("__", "."): value for key, value in changes.items()}
    return load_scenario(RIG, overrides)


def end_of(scenario):
    """Run a scenario and return its problem and its last state."""
    problem, stepper, _ = assemble_problem(draw(scenario))
    state = fresh_state(problem)
    for advance in evolve(
        problem, state, stepper, float(scenario.total_passes), lambda _: float("inf"), 10**6
    ):
        state = advance.end
    return problem, state
