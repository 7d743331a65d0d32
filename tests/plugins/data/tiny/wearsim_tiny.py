"""Third-party plugin: an elastic foundation, a wear law by line load and a drifting load."""

import numpy as np

from wearsim.plugins import (
    ContactModelSpec,
    LoadSpec,
    LoadTerm,
    Options,
    SingleContactModel,
    WearLaw,
    WearLawSpec,
    hookimpl,
)
from wearsim.types import ContactSolution


class Foundation(SingleContactModel):
    """Independent springs in gross sliding, without optional capabilities."""

    def __init__(self, options, grid, materials):
        self.modulus, self.grid = options.foundation_modulus, grid

    def _line_load(self, gap, curvature, approach):
        depth = np.maximum(approach - gap, 0.0)
        half_length = np.sqrt(2.0 * depth / curvature)
        return 4.0 / 3.0 * self.modulus * depth * half_length, half_length

    def _approach(self, gap, curvature, force):
        """Return the approach by Newton's method: as the load is convex, it converges from above.

        A second increase is due to round-off.
        """
        approach, last = gap.min() + 5e-6, np.inf
        while True:
            load, half_length = self._line_load(gap, curvature, approach)
            stiffness = 2.0 * self.modulus * half_length.sum() * self.grid.spacing
            change = (force - load.sum() * self.grid.spacing) / stiffness
            if last < 0.0 <= change or abs(change) <= 1e-15 * abs(approach):
                return approach
            approach, last = approach + change, change

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        if wear_compliance is not None:
            raise ValueError("wear compliance without the capability")
        spacing, force = self.grid.spacing, point.normal_force
        approach = self._approach(gap, longitudinal_curvature, force)
        load, half_length = self._line_load(gap, longitudinal_curvature, approach)
        creepage = point.creepage
        slip = np.hypot(creepage.longitudinal, creepage.lateral)
        dissipation = point.friction * load * slip * point.rolling_speed
        traction = -point.friction * force / slip
        return ContactSolution(
            y=self.grid.y,
            half_length=half_length,
            line_load=load,
            dissipation=dissipation,
            force_x=traction * creepage.longitudinal,
            force_y=traction * creepage.lateral,
            spin_moment=0.0,
            approach=approach,
            peak_pressure=self.modulus * (approach - gap.min()),
            adhesion_fraction=0.0,
            power=dissipation.sum() * spacing,
            longitudinal_creepage=creepage.longitudinal,
            iterations=1,
        )


class FoundationOptions(Options):
    foundation_modulus: float = 2.0e13  # Pa/m


class Abrasion(WearLaw):
    """Depth per pass proportional to the line load, on the cylinder only."""

    def __init__(self, options):
        self.factor = options.factor

    def depth_per_pass(self, body, solution, rolling_speed):
        return (self.factor if body == "cylinder" else 0.0) * solution.line_load


class AbrasionOptions(Options):
    factor: float = 1e-15  # m/(N/m)


class Drift(LoadTerm):
    """Load that increases with the dissipated energy without limit."""

    def __init__(self, options):
        self.rate = options.rate

    def advance(self, state, power, duration):
        return state + self.rate * power * duration

    def mean_force(self, state, power, duration):
        return state + 0.5 * self.rate * power * duration


class DriftOptions(Options):
    rate: float = 0.1  # N/J


@hookimpl
def wearsim_contact_models():
    yield ContactModelSpec(
        name="foundation",
        factory=Foundation,
        options=FoundationOptions,
        summary="elastic foundation",
        protocol=2,
    )


@hookimpl
def wearsim_wear_laws():
    yield WearLawSpec(
        name="abrasion",
        factory=Abrasion,
        options=AbrasionOptions,
        summary="wear proportional to line load",
        protocol=2,
    )


@hookimpl
def wearsim_loads():
    yield LoadSpec(
        name="drift",
        factory=Drift,
        options=DriftOptions,
        role="term",
        summary="load by dissipated energy",
        protocol=2,
    )
