"""Contact models that break one promise each, made of a built-in one that keeps them all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import ContactError
from wearsim.models.contact.hertz_fastsim import HertzFastsim
from wearsim.models.contact.slender import Slender
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import ContactModelSpec, Options
from wearsim.types import Creepage, Grid, OperatingPoint

ANY = Creepage(1e-3)


class Sound(Slender):
    """The model that all but one of the mutants are made of."""

    def __init__(self):
        super().__init__(StripTheory())


def after(change):
    """Return a model whose answers are changed by `change(solution, gap)`, a dict of fields."""

    class Spoilt(Sound):
        def solve(self, gap, curvature, point, wear_compliance=None, warm=None):
            found = super().solve(gap, curvature, point, wear_compliance, warm)
            return replace(found, **change(found, gap))

    return Spoilt


def before(change):
    """Return a model that answers another question: `change(gap, point, compliance)`."""

    class Misled(Sound):
        def solve(self, gap, curvature, point, wear_compliance=None, warm=None):
            gap, point, wear_compliance = change(gap, point, wear_compliance)
            return super().solve(gap, curvature, point, wear_compliance, warm)

    return Misled


def without(capability, model=Sound):
    """Return a model that does what it does not claim."""

    class Modest(model):
        capabilities = replace(model.capabilities, **{capability: False})

    return Modest


class Restless(Sound):
    """Answers a little more every time."""

    asked = 0

    def solve(self, *args, **kwargs):
        self.asked += 1
        found = super().solve(*args, **kwargs)
        return replace(found, approach=found.approach * (1.0 + 1e-14 * self.asked))


class Buffered(Sound):
    """Answers in arrays that it uses again."""

    def prepare(self, grid, materials):
        super().prepare(grid, materials)
        self.load = np.zeros(grid.strips)

    def solve(self, *args, **kwargs):
        found = super().solve(*args, **kwargs)
        self.load[:] = found.line_load
        return replace(found, line_load=self.load)


class Scribbling(Sound):
    """Writes into the gap that it is given."""

    def solve(self, gap, *args, **kwargs):
        gap += 1e-9
        return super().solve(gap, *args, **kwargs)


class Inert(Sound):
    """Takes a part of its start for the answer."""

    def solve(self, gap, curvature, point, wear_compliance=None, warm=None):
        found = super().solve(gap, curvature, point, wear_compliance, warm)
        if warm is None:
            return found
        return replace(found, line_load=0.99 * found.line_load + 0.01 * warm.line_load)


class Unflinching(Sound):
    """Answers what has no answer with another contact."""

    def solve(self, gap, curvature, point, *args, **kwargs):
        try:
            return super().solve(gap, curvature, point, *args, **kwargs)
        except ContactError:
            return super().solve(self._grid.y**2, 90.0, OperatingPoint(300.0, 1.0, ANY, 0.1))


class Crashing(Sound):
    """Divides by the load."""

    def solve(self, gap, curvature, point, *args, **kwargs):
        1.0 / point.normal_force
        return super().solve(gap, curvature, point, *args, **kwargs)


class Cutting(Sound):
    """Cuts a contact that reaches beyond its strips short."""

    def _check(self, status, gap, loads, line_load, approach):
        inside = line_load.copy()
        inside[:, [0, -1]] = 0.0
        super()._check(status, gap, loads, inside, approach)


class Batched(Sound):
    """Solves batches a little differently."""

    def solve_batch(self, *args, **kwargs):
        found = super().solve_batch(*args, **kwargs)
        columns = dict(found.columns) | {"power": 1.001 * found.columns["power"]}
        return replace(found, columns=columns)


class Nameless(Sound):
    """Does not say which contact of a batch failed."""

    def solve_batch(self, *args, **kwargs):
        try:
            return super().solve_batch(*args, **kwargs)
        except ContactError as error:
            raise ContactError("a contact failed") from error


class Narrow(Sound):
    """Suggests strips that do not hold the contact."""

    def suggest_grid(self, *args):
        return Grid.spanning(-1e-4, 1e-4, 31)


class Separate(Sound):
    """Says that it couples contacts and solves each by itself."""

    def solve_coupled(self, gap, curvature, points, wear, warm=None):
        if len(points) == 1:
            return super().solve_coupled(gap, curvature, points, wear, warm)
        return [self.solve(gap[k], curvature, point) for k, point in enumerate(points)]


class Weightless(Sound):
    """Does not count all the energy of its passes."""

    def pass_loop(self, loop):
        solved = super().pass_loop(loop)
        loop.energy *= 0.99
        return solved


class Idle(without("pass_loop", Sound)):
    """Claims no loop, and runs none when asked."""

    def pass_loop(self, loop):
        return 0


class Faded(Sound):
    """Gives fields that do not add up."""

    def fields(self, *args, **kwargs):
        found = super().fields(*args, **kwargs)
        return replace(found, traction_x=0.9 * found.traction_x)


class Turned(Sound):
    """Gives fields whose lateral traction points the wrong way."""

    def fields(self, *args, **kwargs):
        found = super().fields(*args, **kwargs)
        return replace(found, traction_y=-found.traction_y)


class Averaging(HertzFastsim):
    """Says that it takes a field of friction and takes its mean."""

    def solve(self, gap, curvature, point, wear_compliance=None, warm=None):
        point = replace(point, friction=float(np.mean(point.friction)))
        return super().solve(gap, curvature, point, wear_compliance, warm)


def _varied(gap, point, compliance):
    creepage = replace(point.creepage, variation=None)
    return gap, replace(point, creepage=creepage), compliance


def _evened(gap, point, compliance):
    return gap, replace(point, friction=float(np.mean(point.friction))), compliance


def _crept(gap, point, compliance):
    creepage = point.creepage
    more = Creepage(creepage.longitudinal, creepage.lateral + 1e-6, creepage.spin)
    return gap, replace(point, creepage=more), compliance


def _leaning(gap, point, compliance):
    return gap + np.linspace(0.0, 1e-8, len(gap)), point, compliance


MUTANTS = {
    "solution-is-whole-and-finite": [
        after(lambda found, gap: {"power": np.nan}),
        after(lambda found, gap: {"half_length": found.half_length[1:]}),
        after(lambda found, gap: {"force_x": np.array([found.force_x])}),
    ],
    "strips-carry-the-load": [after(lambda found, gap: {"line_load": 1.01 * found.line_load})],
    "nothing-outside-the-contact": [
        after(lambda found, gap: {"dissipation": found.dissipation + 1e-12}),
        after(lambda found, gap: {"dissipation": found.dissipation - 1e-12}),
    ],
    "power-is-the-sum-over-the-strips": [
        after(lambda found, gap: {"dissipation": 0.99 * found.dissipation})
    ],
    "power-is-the-work-of-the-rigid-slip": [
        after(
            lambda found, gap: {
                "dissipation": 0.99 * found.dissipation,
                "power": 0.99 * found.power,
            }
        )
    ],
    "creepage-is-the-mean-that-was-asked": [
        after(lambda found, gap: {"longitudinal_creepage": found.longitudinal_creepage + 1e-9})
    ],
    "forces-obey-coulomb": [
        before(lambda gap, point, c: (gap, replace(point, friction=1.1 * point.friction), c)),
    ],
    "gross-sliding-leaves-no-adhesion": [
        after(lambda found, gap: {"adhesion_fraction": -0.1}),
        after(lambda found, gap: {"adhesion_fraction": 1.0 - found.adhesion_fraction}),
    ],
    "peak-pressure-is-no-less-than-a-mean": [
        after(lambda found, gap: {"peak_pressure": 0.5 * found.peak_pressure})
    ],
    "no-creepage-no-power": [before(_crept)],
    "mirror-image-has-the-mirrored-answer": [before(_leaning)],
    "zero-of-the-gap-is-arbitrary": [
        after(lambda found, gap: {"approach": found.approach - gap.min()}),
        after(lambda found, gap: {"approach": gap.min()}),
    ],
    "approach-rises-with-load": [
        after(lambda found, gap: {"approach": 1.0}),
        after(lambda found, gap: {"peak_pressure": -found.peak_pressure}),
    ],
    "answers-settle-as-strips-are-refined": [
        after(lambda found, gap: {"peak_pressure": found.peak_pressure * len(gap)})
    ],
    "same-bits-twice": [Restless, Buffered],
    "inputs-are-left-as-they-were": [Scribbling],
    "warm-start-changes-nothing": [Inert],
    "impossible-input-is-a-clean-error": [Unflinching, Crashing],
    "contact-beyond-the-strips-is-a-clean-error": [Cutting],
    "many-contacts-are-solved-as-each-alone": [Batched],
    "batch-names-the-contact-that-fails": [Nameless],
    "suggested-strips-hold-the-contact": [Narrow],
    "wear-compliance": [
        without("wear_compliance"),
        before(lambda gap, point, c: (gap, point, None)),
    ],
    "coupled": [without("coupled"), Separate],
    "creepage-variation": [without("creepage_variation"), before(_varied)],
    "bearing-torque": [
        without("bearing_torque"),
        before(lambda gap, point, c: (gap, replace(point, bearing_torque=None), c)),
    ],
    "local-friction": [without("local_friction"), before(_evened)],
    "friction-field": [without("friction_field", HertzFastsim), Averaging],
    "fields": [
        without("fields"),
        Faded,
        Turned,
        after(lambda found, gap: {"peak_pressure": 2.0 * found.peak_pressure}),
    ],
    "pass-loop": [Idle, Weightless],
}


def spec_of(model, **changes):
    """Return a spec that builds a mutant and claims what it does."""
    able = model().capabilities
    given = {"name": "mutant", "options": Options, "summary": "a model that breaks a promise"}
    return ContactModelSpec(
        **(given | {"factory": lambda options: model(), "capabilities": able} | changes)
    )
