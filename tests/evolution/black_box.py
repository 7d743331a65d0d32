"""Contact models without capabilities, for steppers that require `solve` only."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

from tests.evolution import built
from wearsim.plugins import Capabilities, SingleContactModel

TINY = Path(__file__).parents[1] / "plugins" / "data" / "tiny" / "wearsim_tiny.py"


class BlackBox(SingleContactModel):
    """Contact model that hides the capabilities of another and counts its solves."""

    def __init__(self, inner):
        self.inner, self.solved = inner, 0
        self.capabilities = Capabilities(creepage_variation=inner.capabilities.creepage_variation)

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        assert wear_compliance is None
        self.solved += 1
        return self.inner.solve_one(gap, longitudinal_curvature, point, None, warm)


def foundation_model(grid):
    """Return the elastic foundation of the example plugin for a grid."""
    spec = importlib.util.spec_from_file_location("wearsim_tiny", TINY)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Foundation(module.FoundationOptions(), grid, None)


def boxed(foundation=False, box=BlackBox, **changes):
    """Return problem, stepper and passes of the rig with a model without capabilities.

    The model is the built-in one of slender contacts or an elastic foundation.
    """
    problem, stepper, stop = built(evolution__stepper="stabilised", **changes)
    model = foundation_model(problem.grid) if foundation else problem.model
    return replace(problem, model=box(model)), stepper, stop
