"""Mean problem and Monte Carlo study of the paper, in several variants."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.results.viewed import Viewed
from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.batch import LocalFriction
from wearsim.studies.contact.single import ContactStudy, study_contact
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.dissipation.result import DissipationResult
from wearsim.studies.run.inputs import FRICTION, LONGITUDINAL, TILT, YAW
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray
from wearsim_chevalier2005 import paper

MEAN_PROBLEM, MONTE_CARLO = "mean-contact", "paper-monte-carlo"
_ALIGNED = {YAW: "0 mrad", TILT: "0 mrad"}
_ELEMENT_SUM = {"contact.dissipation": "element-sum"}
_AS_PRINTED = {
    "roller.radius": f"{paper.ROLLER_RADIUS.value!r} m",
    "roller.crown_radius": f"{paper.CROWN_RADIUS.value!r} m",
    "cylinder.radius": f"{paper.CYLINDER_RADIUS.value!r} m",
}


@dataclass(frozen=True)
class Variant:
    """A variant of the Monte Carlo study.

    Parameters
    ----------
    aligned : bool
        Without lateral creepage and spin.
    white : bool
        Independent friction in every cell of the grid, as in the paper; otherwise one friction
        coefficient per contact.
    element_sum : bool
        Power as the sum over elements; otherwise the work of the rigid slip.
    """

    aligned: bool
    white: bool
    element_sum: bool


VARIANTS = tuple(
    Variant(aligned, white, element_sum)
    for aligned in (True, False)
    for white in (False, True)
    for element_sum in (False, True)
)


@dataclass(frozen=True, eq=False)
class Reproduction(Viewed):
    """Solutions of the problems of the paper.

    Parameters
    ----------
    mean : ContactStudy
        The mean problem with its fields.
    element_sum, slender : ContactStudy
        The mean problem with the element sum, and with the contact model `slender`.
    as_printed : ContactStudy
        The mean problem with the printed dimensions as radii.
    white_friction : ContactStudy
        The mean problem with one realisation of white friction, with its fields.
    mean_scenario, printed_scenario, scenario : Scenario
        Scenarios of the mean problem, of that with the printed radii, and of the Monte Carlo study.
    spread : mapping of Variant to DissipationResult
        The Monte Carlo study, with the same draws for all variants.
    """

    mean: ContactStudy
    element_sum: ContactStudy
    slender: ContactStudy
    as_printed: ContactStudy
    white_friction: ContactStudy
    mean_scenario: Scenario
    printed_scenario: Scenario
    scenario: Scenario
    spread: Mapping[Variant, DissipationResult]

    def __repr__(self) -> str:
        count, mean = self.all_inputs.count, self.all_inputs.summaries["power"].mean
        return f"<Reproduction: {count} realisations, power {mean:.4g} W>"

    @property
    def all_inputs(self) -> DissipationResult:
        """Monte Carlo study of all inputs, with one friction coefficient per contact."""
        return self.spread[Variant(aligned=False, white=False, element_sum=False)]

    @property
    def aligned(self) -> DissipationResult:
        """Monte Carlo study without lateral creepage and spin."""
        return self.spread[Variant(aligned=True, white=False, element_sum=False)]

    @cached_property
    def max_power(self) -> FloatArray:
        """Upper bound of the power of each realisation, shape (realisations,) [W]."""
        return max_power(self.scenario, self.all_inputs)


def reproduce(
    realisations: int = 1000,
    seed: int | None = None,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Solve the problems of the paper.

    Parameters
    ----------
    realisations : int
        Realisations of each variant, at least 2.
    seed : int, optional
        Seed; by default that of the scenario.
    on_progress : callable, optional
        Called with the completed and the total number of realisations.

    Raises
    ------
    ValueError
        If there are fewer than 2 realisations.
    """
    if realisations < 2:
        raise ValueError(
            f"realisations must be 2 or more for a standard deviation, got {realisations}"
        )
    seeded = {} if seed is None else {"seed": seed}
    scenario = shipped_scenario(MONTE_CARLO, seeded)
    white = {FRICTION: white_friction(scenario)}
    mean = shipped_scenario(MEAN_PROBLEM)
    printed = shipped_scenario(MEAN_PROBLEM, _AS_PRINTED)
    spread = {}
    report = on_progress or (lambda done, total: None)
    for number, variant in enumerate(VARIANTS):

        def report_variant(done: int, _: int, before: int = number * realisations) -> None:
            report(before + done, len(VARIANTS) * realisations)

        changes = {
            **(_ALIGNED if variant.aligned else {}),
            **(white if variant.white else {}),
            **(_ELEMENT_SUM if variant.element_sum else {}),
        }
        varied = shipped_scenario(MONTE_CARLO, {**seeded, **changes})
        spread[variant] = dissipation(varied, realisations, on_progress=report_variant)
    return Reproduction(
        mean=study_contact(mean, with_fields=True),
        element_sum=study_contact(shipped_scenario(MEAN_PROBLEM, _ELEMENT_SUM)),
        slender=study_contact(shipped_scenario(MEAN_PROBLEM, {"contact": {"model": "slender"}})),
        as_printed=study_contact(printed),
        white_friction=_with_white_friction(shipped_scenario(MEAN_PROBLEM, {**seeded, **white})),
        mean_scenario=mean,
        printed_scenario=printed,
        scenario=scenario,
        spread=spread,
    )


def white_friction(scenario: Scenario) -> dict[str, object]:
    """Return the friction table with independent friction in every cell."""
    item = next(item for item in scenario.random if item.name == FRICTION)
    return {"distribution": "white", "marginal": {"distribution": item.kind, **item.options}}


def _with_white_friction(scenario: Scenario) -> ContactStudy:
    """Return the mean problem with one realisation of white friction."""
    study = study_contact(scenario)
    materials = scenario.materials
    model = scenario.contact.build(study.grid, materials)
    curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    batch = ContactBatch.of(study.gap[None], curvature, [study.point])
    item = next(item for item in scenario.random if item.name == FRICTION)
    local = LocalFriction(scenario, model, item)
    batch = local.put(batch, *model.friction_points(batch), 0)
    solution, point = model.solve(batch)[0], batch.point(0)
    fields = model.fields(solution, study.gap, curvature, point)
    return replace(study, solution=solution, fields=fields, point=point)


def max_power(scenario: Scenario, result: DissipationResult) -> FloatArray:
    """Return an upper bound of the power for any contact model that satisfies the energy balance.

    Traction nowhere exceeds mu p, so that P <= mu V int p |w| dA with the rigid slip
    w = (xi - phi y, eta + phi x). The mean of |w| is at most its root mean square, which for
    Hertz's pressure on the half-axes a, b is sqrt(xi^2 + eta^2 + phi^2 (a^2 + b^2)/5).

    Parameters
    ----------
    scenario : Scenario
        Scenario of the study.
    result : DissipationResult
        Results with one friction coefficient per contact.

    Returns
    -------
    ndarray, shape (realisations,)
        Upper bounds [W].
    """
    load, drawn = result.values("normal_force"), result.inputs
    spin = drawn[TILT] / scenario.roller.radius
    reference = float(load.mean())
    patch = Setup(scenario).fresh_patch(reference)
    axes = (patch.a**2 + patch.b**2) * np.cbrt(load / reference) ** 2  # a, b as N^(1/3)
    slip = np.sqrt(drawn[LONGITUDINAL] ** 2 + drawn[YAW] ** 2 + spin**2 * axes / 5.0)
    limit: FloatArray = drawn[FRICTION] * load * scenario.rolling_speed * slip
    return limit
