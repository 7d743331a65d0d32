"""Contact models that each violate one requirement, derived from built-in models."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from wearsim.errors import ContactError
from wearsim.models.contact.hertz_fastsim import HertzFastsim, HertzFastsimOptions
from wearsim.models.contact.slender import Slender
from wearsim.models.contact.strip_model import grid_about_hertz
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import ContactModelSpec, Options, SingleContactModel
from wearsim.types import ContactSolution, Creepage, Grid, OperatingPoint

CREEPAGE = Creepage(1e-3)


class Unmodified(Slender):
    """Base class of all mutants but two."""

    def __init__(self, grid, materials):
        super().__init__(StripTheory(), grid, materials)


class UnmodifiedFastsim(HertzFastsim):
    """Base class of the mutants with a friction field."""

    def __init__(self, grid, materials):
        super().__init__(HertzFastsimOptions(), grid, materials)


def after(change):
    """Return a model whose solutions are changed by `change(solution, gap)`, a dict of fields."""

    class ChangedSolution(Unmodified):
        def solve_one(self, gap, curvature, point, wear_compliance=None, warm=None):
            solution = super().solve_one(gap, curvature, point, wear_compliance, warm)
            return replace(solution, **change(solution, gap))

    return ChangedSolution


def before(change):
    """Return a model that solves other inputs: `change(gap, point, compliance)`."""

    class ChangedInput(Unmodified):
        def solve_one(self, gap, curvature, point, wear_compliance=None, warm=None):
            gap, point, wear_compliance = change(gap, point, wear_compliance)
            return super().solve_one(gap, curvature, point, wear_compliance, warm)

    return ChangedInput


def without(capability, model=Unmodified):
    """Return a model that does not claim a capability it has."""

    class Unclaimed(model):
        capabilities = replace(model.capabilities, **{capability: False})

        def solve(self, *args, **kwargs):
            able = copy(self)
            able.capabilities = model.capabilities
            return model.solve(able, *args, **kwargs)

    return Unclaimed


class Drifting(Unmodified):
    """Returns a slightly larger approach at every call."""

    calls = 0

    def solve_one(self, *args, **kwargs):
        self.calls += 1
        solution = super().solve_one(*args, **kwargs)
        return replace(solution, approach=solution.approach * (1.0 + 1e-14 * self.calls))


class Buffered(Unmodified):
    """Returns arrays that later calls overwrite."""

    def __init__(self, grid, materials):
        super().__init__(grid, materials)
        self.load = np.zeros(grid.strips)

    def solve_one(self, *args, **kwargs):
        solution = super().solve_one(*args, **kwargs)
        self.load[:] = solution.line_load
        return replace(solution, line_load=self.load)


class ChangesInput(Unmodified):
    """Changes the gap in place."""

    def solve_one(self, gap, *args, **kwargs):
        gap += 1e-9
        return super().solve_one(gap, *args, **kwargs)


class LevelsInput(Unmodified):
    """Subtracts the smallest gap in place, after the solution."""

    def solve_one(self, gap, *args, **kwargs):
        solution = super().solve_one(gap, *args, **kwargs)
        gap -= gap.min()
        return solution


class DependsOnWarmStart(Unmodified):
    """Mixes the warm start into the solution."""

    def solve_one(self, gap, curvature, point, wear_compliance=None, warm=None):
        solution = super().solve_one(gap, curvature, point, wear_compliance, warm)
        if warm is None:
            return solution
        return replace(solution, line_load=0.99 * solution.line_load + 0.01 * warm.line_load)


class HidesErrors(Unmodified):
    """Returns the solution of another contact instead of an error."""

    def solve_one(self, gap, curvature, point, *args, **kwargs):
        try:
            return super().solve_one(gap, curvature, point, *args, **kwargs)
        except ContactError:
            return super().solve_one(
                self._grid.y**2, 90.0, OperatingPoint(300.0, 1.0, CREEPAGE, 0.1)
            )


class WrongError(Unmodified):
    """Raises ZeroDivisionError for a zero load."""

    def solve_one(self, gap, curvature, point, *args, **kwargs):
        1.0 / point.normal_force
        return super().solve_one(gap, curvature, point, *args, **kwargs)


class Truncating(Unmodified):
    """Truncates a contact that is wider than the strips."""

    def _check(self, status, gap, loads, line_load, approach):
        inside = line_load.copy()
        inside[:, [0, -1]] = 0.0
        super()._check(status, gap, loads, inside, approach)


class WrongBatch(Unmodified):
    """Returns a slightly different power in batches of several contacts."""

    def solve(self, batch, *args, **kwargs):
        solution = super().solve(batch, *args, **kwargs)
        return replace(solution, power=1.001 * solution.power) if len(batch) > 1 else solution


class IgnoresCurvatures(Unmodified):
    """Solves all contacts of a batch with the curvature of the first."""

    def solve(self, batch, *args, **kwargs):
        same = np.full(len(batch), batch.longitudinal_curvature[0])
        return super().solve(replace(batch, longitudinal_curvature=same), *args, **kwargs)


class UnnamedBatchError(Unmodified):
    """Does not name the failed contact of a batch."""

    def solve(self, *args, **kwargs):
        try:
            return super().solve(*args, **kwargs)
        except ContactError as error:
            raise ContactError("a contact failed") from error


class NarrowGrid(Unmodified):
    """Suggests strips narrower than the contact."""

    @staticmethod
    def suggest_grid(*args):
        return Grid.spanning(-1e-4, 1e-4, 31)


class Uncoupled(Unmodified):
    """Claims coupled contacts and solves them separately."""

    def solve(self, batch, wear_compliance=None, coupling=None, warm=None):
        return super().solve(batch, wear_compliance, None, warm)


class LosesEnergy(Unmodified):
    """Returns 99 % of the dissipated energy."""

    def pass_loop(self, loop):
        solved = super().pass_loop(loop)
        loop.energy *= 0.99
        return solved


class IgnoresLoop(without("pass_loop", Unmodified)):
    """Claims no pass loop, and returns without an error."""

    def pass_loop(self, loop):
        return 0


class WeakTraction(Unmodified):
    """Returns a traction that does not integrate to the force."""

    def fields(self, *args, **kwargs):
        solution = super().fields(*args, **kwargs)
        return replace(solution, traction_x=0.9 * solution.traction_x)


class ReversedTraction(Unmodified):
    """Returns a lateral traction of the wrong sign."""

    def fields(self, *args, **kwargs):
        solution = super().fields(*args, **kwargs)
        return replace(solution, traction_y=-solution.traction_y)


class AveragesFriction(UnmodifiedFastsim):
    """Claims a friction field and uses its mean."""

    def solve_one(self, gap, curvature, point, wear_compliance=None, warm=None):
        point = replace(point, friction=float(np.mean(point.friction)))
        return super().solve_one(gap, curvature, point, wear_compliance, warm)


class IgnoresFactor(Unmodified):
    """Claims a creep factor and ignores it."""

    def with_creep_factor(self, factor):
        return self


class KeepsFactor(Unmodified):
    """Applies the creep factor to itself too."""

    def with_creep_factor(self, factor):
        self._tangential = self._pair.reduced(factor)
        return self


def _without_variation(gap, point, compliance):
    creepage = replace(point.creepage, variation=None)
    return gap, replace(point, creepage=creepage), compliance


def _mean_friction(gap, point, compliance):
    return gap, replace(point, friction=float(np.mean(point.friction))), compliance


def _extra_creepage(gap, point, compliance):
    creepage = point.creepage
    more = Creepage(creepage.longitudinal, creepage.lateral + 1e-6, creepage.spin)
    return gap, replace(point, creepage=more), compliance


def _inclined_gap(gap, point, compliance):
    return gap + np.linspace(0.0, 1e-8, len(gap)), point, compliance


def without_hardening(model):
    """Return a model that omits the hardening term, about 20 %, from its peak pressure."""

    class LacksHardening(model):
        def solve_one(self, gap, curvature, point, wear_compliance=None, warm=None):
            solution = super().solve_one(gap, curvature, point, wear_compliance, warm)
            peak = solution.peak_pressure
            return replace(solution, peak_pressure=peak / (1.0 + 0.3 * peak / 1e9))

    return LacksHardening


class ForgetsHardening(SingleContactModel):
    """Foundation that hardens with depth d, p = k d (1 + d/d_0), with the peak pressure k d."""

    def __init__(self, grid, materials):
        self.grid = grid

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        modulus, hardening, spacing = 3e14, 5e-6, self.grid.spacing
        level = np.linspace(gap.min(), gap.min() + 2e-5, 20_001)[:, None]
        depth = np.maximum(level - gap, 0.0)
        half_length = np.sqrt(2.0 * depth / longitudinal_curvature)
        # mean of d and of d^2 along a strip: 2/3 and 8/15 of their values in the middle
        line_load = (
            2.0 * half_length * modulus * depth * (2.0 / 3.0 + 8.0 / 15.0 * depth / hardening)
        )
        chosen = int(np.searchsorted(line_load.sum(axis=1) * spacing, point.normal_force))
        zeros = np.zeros_like(gap)
        return ContactSolution(
            *(self.grid.y, half_length[chosen], line_load[chosen], zeros, 0.0, 0.0, 0.0),
            approach=float(level[chosen, 0]),
            peak_pressure=modulus * float(depth[chosen].max()),
            adhesion_fraction=0.0,
            power=0.0,
            longitudinal_creepage=point.creepage.longitudinal,
            iterations=1,
        )


MUTANTS = {
    "solution-is-complete-and-finite": [
        after(lambda solution, gap: {"power": np.nan}),
        after(lambda solution, gap: {"dissipation": np.nan * solution.dissipation}),
        after(lambda solution, gap: {"half_length": solution.half_length[1:]}),
        after(lambda solution, gap: {"force_x": np.array([solution.force_x])}),
    ],
    "strips-carry-the-load": [
        after(lambda solution, gap: {"line_load": 1.01 * solution.line_load})
    ],
    "zero-outside-the-contact": [
        after(lambda solution, gap: {"dissipation": solution.dissipation + 1e-12}),
        after(lambda solution, gap: {"dissipation": solution.dissipation - 1e-12}),
        after(lambda solution, gap: {"dissipation": -solution.dissipation}),
        after(lambda solution, gap: {"half_length": 1e3 * solution.half_length}),  # in mm
    ],
    "power-equals-strip-sum": [
        after(lambda solution, gap: {"dissipation": 0.99 * solution.dissipation})
    ],
    "power-equals-rigid-slip-work": [
        after(
            lambda solution, gap: {
                "dissipation": 0.99 * solution.dissipation,
                "power": 0.99 * solution.power,
            }
        )
    ],
    "mean-creepage-is-preserved": [
        after(
            lambda solution, gap: {"longitudinal_creepage": solution.longitudinal_creepage + 1e-9}
        )
    ],
    "force-within-coulomb-bound": [
        before(lambda gap, point, c: (gap, replace(point, friction=1.1 * point.friction), c)),
    ],
    "no-adhesion-in-gross-sliding": [
        after(lambda solution, gap: {"adhesion_fraction": -0.1}),
        after(lambda solution, gap: {"adhesion_fraction": 1.0 - solution.adhesion_fraction}),
    ],
    "peak-pressure-exceeds-strip-means": [
        after(lambda solution, gap: {"peak_pressure": 0.5 * solution.peak_pressure})
    ],
    "no-power-without-creepage": [before(_extra_creepage)],
    "mirror-symmetry": [before(_inclined_gap)],
    "gap-offset-shifts-approach": [
        after(lambda solution, gap: {"approach": solution.approach - gap.min()}),
        after(lambda solution, gap: {"approach": gap.min()}),
    ],
    "approach-rises-with-load": [
        after(lambda solution, gap: {"approach": 1.0}),
        after(lambda solution, gap: {"peak_pressure": -solution.peak_pressure}),
    ],
    "convergence-with-strips": [
        after(lambda solution, gap: {"peak_pressure": solution.peak_pressure * len(gap)})
    ],
    "repeated-solves-identical": [Drifting, Buffered],
    "inputs-unchanged": [ChangesInput, LevelsInput],
    "result-independent-of-warm-start": [DependsOnWarmStart],
    "invalid-input-raises-contact-error": [HidesErrors, WrongError],
    "contact-wider-than-strips-raises": [Truncating],
    "batch-equals-single-solves": [WrongBatch, IgnoresCurvatures],
    "batch-error-names-contact": [UnnamedBatchError],
    "suggested-grid-holds-contact": [NarrowGrid],
    "wear-compliance": [
        without("wear_compliance"),
        before(lambda gap, point, c: (gap, point, None)),
    ],
    "coupled": [without("coupled"), Uncoupled],
    "creepage-variation": [without("creepage_variation"), before(_without_variation)],
    "bearing-torque": [
        without("bearing_torque"),
        before(lambda gap, point, c: (gap, replace(point, bearing_torque=None), c)),
    ],
    "local-friction": [without("local_friction"), before(_mean_friction)],
    "friction-field": [without("friction_field", UnmodifiedFastsim), AveragesFriction],
    "fields": [
        without("fields"),
        WeakTraction,
        ReversedTraction,
        after(lambda solution, gap: {"peak_pressure": 2.0 * solution.peak_pressure}),
    ],
    "peak-pressure-follows-strips": [
        without_hardening(without("fields")),
        without_hardening(Unmodified),
        ForgetsHardening,
    ],
    "creep-factor": [without("creep_factor"), IgnoresFactor, KeepsFactor],
    "pass-loop": [IgnoresLoop, LosesEnergy],
}


def spec_of(model, **changes):
    """Return the spec of a mutant, with the capabilities of the model."""
    fields = {
        "name": "mutant",
        "options": Options,
        "summary": "a model that violates a requirement",
        "factory": lambda options, grid, materials: model(grid, materials),
        "capabilities": model.capabilities,
        "suggest_grid": getattr(model, "suggest_grid", grid_about_hertz),
        "protocol": 2,
    }
    return ContactModelSpec(**(fields | changes))
