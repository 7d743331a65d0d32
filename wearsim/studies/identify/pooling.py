"""Wear factors of all specimens together: hierarchy, verdict, and the content of the results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.scenario import Scenario
from wearsim.studies.identify.analysis import Identified, exponent, kernel_of
from wearsim.studies.identify.likelihood import DrawLikelihood
from wearsim.studies.identify.result import IdentificationData
from wearsim.studies.preparation import origin_of
from wearsim.types import FloatArray
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import PRIOR_SCALE, Posterior
from wearsim.uq.hierarchy.verdict import ALPHA, MOST_TESTS, Design, Power, word

PRIORS = (0.25, 0.5, 1.0, 2.0)  # scales of the half-normal prior of t
SHOWN = 0.4  # scatter of ln K/H for which the power is stated
MEASURED = 0.1  # standard deviation of ln K/H if the inputs are measured
FEW_DRAWS = 25.0
_CURVE = 601  # values of ln K/H of a stored density
_GRID = 2001  # values of ln K/H at which the likelihoods of several tests are multiplied
_ROUNDS = 8  # of narrowing that grid
_DROPPED = 40.0  # of a log likelihood below the greatest
_AGREEMENT = 1e-3  # probability below which grooves of a specimen contradict each other
_FIVE = (0.025, 0.05, 0.5, 0.95, 0.975)
_NOTHING_RANDOM = (
    "no input of the scenario is random: differences of load, friction, creepage or slack"
    " between the tests count as scatter of K/H; give their distributions in the scenario,"
    " or measured values with std in a tests file"
)


@dataclass(frozen=True)
class Specimen:
    """Traces of one specimen.

    Parameters
    ----------
    name : str
    tests : list of list of Identified
        Traces of each test in the order of passes.
    kernel : LikelihoodMixture
        Likelihood of ln K/H.
    agreement : float
        Probability of greater differences between the K/H of its grooves, if they have one K/H.
    """

    name: str
    tests: list[list[Identified]]
    kernel: LikelihoodMixture
    agreement: float = 1.0


def specimens_of(rows: Sequence[Identified]) -> list[Specimen]:
    """Return the specimens of measured grooves.

    Grooves of a group are of one specimen. A groove at more passes than the one before it in the
    group, or at the same passes and another angle of a cam, is of the same test, and shares all
    inputs with it; otherwise it begins another test.

    Parameters
    ----------
    rows : sequence of Identified
    """
    groups: dict[str, list[Identified]] = {}
    for number, row in enumerate(rows):
        groups.setdefault(row.item.group or f"\0{number}", []).append(row)
    specimens = []
    for name, members in groups.items():
        tests: list[list[Identified]] = []
        for row in members:
            before = [(test.passes, test.item.surface) for test in tests[-1]] if tests else []
            later = bool(before) and row.passes >= before[-1][0]
            continues = later and (row.passes, row.item.surface) not in before
            if continues and _same_inputs(row, tests[-1][-1]):
                tests[-1].append(row)
            else:
                tests.append([row])
        label = members[0].item.name if name.startswith("\0") else name
        specimens.append(Specimen(label, tests, *_kernel(label, tests)))
    return specimens


def _same_inputs(first: Identified, other: Identified) -> bool:
    """Return whether two grooves have the same draws of the inputs."""
    known = (first.item.values, first.item.errors) == (other.item.values, other.item.errors)
    return known and len(first.likelihood.mean) == len(other.likelihood.mean)


def _kernel(name: str, tests: Sequence[Sequence[Identified]]) -> tuple[LikelihoodMixture, float]:
    """Return the likelihood of ln K/H of a specimen from all of its tests, and their agreement."""
    from scipy.special import chdtrc  # noqa: PLC0415  (slow to import)

    kernels, agreement = [], 1.0
    for test in tests:
        product: DrawLikelihood = test[0].likelihood
        for row in test[1:]:
            product = product.times(row.likelihood)
        kernels.append(kernel_of(product, name))
        away = [(row.likelihood.mean - product.mean) / row.likelihood.std for row in test]
        least = float(np.square(away).sum(axis=0)[np.isfinite(product.log_evidence)].min())
        if len(test) > 1:
            agreement = min(agreement, float(chdtrc(len(test) - 1, least)))
    if len(kernels) == 1:
        return kernels[0], agreement
    # the product of mixtures, on a grid that is narrowed to where it is
    low = min(k.mean - 5.0 * k.variance**0.5 for k in kernels)
    high = max(k.mean + 5.0 * k.variance**0.5 for k in kernels)
    for _ in range(_ROUNDS):
        grid = np.linspace(low, high, _GRID)
        score = np.array([log_density(k, grid) for k in kernels]).sum(axis=0)
        inside = np.flatnonzero(score > score.max() - _DROPPED)
        if len(inside) > _GRID // 4:
            break
        low, high = (grid[np.clip(end, 0, _GRID - 1)] for end in (inside[0] - 1, inside[-1] + 1))
    best = [float(log_density(k, k.centre).max()) for k in kernels]
    apart = max(2.0 * (sum(best) - float(score.max())), 0.0)
    agreement = min(agreement, float(chdtrc(len(kernels) - 1, apart)))
    kernel = LikelihoodMixture.of(
        np.maximum(score - score.max(), -700.0), grid, np.full_like(grid, grid[1] - grid[0])
    )
    precision = [1.0 / k.variance for k in kernels]
    of_inputs = np.average([k.variance_of_inputs / k.variance for k in kernels], weights=precision)
    return replace(kernel, variance_of_inputs=float(of_inputs) * kernel.variance), agreement


def log_density(kernel: LikelihoodMixture, grid: FloatArray) -> FloatArray:
    """Return the logarithm of the likelihood of ln K/H of a specimen, whose integral is 1."""
    away = (grid[:, None] - kernel.centre) / kernel.std
    parts = -0.5 * away**2 + np.log(kernel.weight / kernel.std) - 0.5 * np.log(2.0 * np.pi)
    top = parts.max(axis=1)
    return np.asarray(top + np.log(np.exp(parts - top[:, None]).sum(axis=1)))


def content(
    scenario: Scenario,
    specimens: Sequence[Specimen],
    negligible: float,
    notes: Sequence[str],
    created: str,
    seconds: float,
    **given: Any,
) -> IdentificationData:
    """Return the content of a results file.

    Parameters
    ----------
    scenario : Scenario
    specimens : sequence of Specimen
    negligible : float
        Scatter of ln K/H below which it is negligible.
    notes : sequence of str
    created : str
        Start of the study, ISO 8601.
    seconds : float
        Its duration.
    **given
        Measurements and options, fields of `IdentificationData` that repeat the study.
    """
    kernels = [specimen.kernel for specimen in specimens]
    posterior = Posterior.of(kernels)
    centres = np.array([kernel.mean for kernel in kernels])
    spread = float(np.sqrt(max(kernel.variance for kernel in kernels)))
    grid = np.linspace(centres.min() - 4.0 * spread, centres.max() + 4.0 * spread, _CURVE)
    rows = [row for specimen in specimens for test in specimen.tests for row in test]
    return IdentificationData(
        **origin_of(scenario),
        finished=True,
        wall_seconds=seconds,
        created=created,
        notes=list(dict.fromkeys(notes)),
        warnings=_warnings(specimens, rows),
        tests=[_test(row, specimen) for specimen in specimens for t in specimen.tests for row in t],
        specimens=[specimen.name for specimen in specimens],
        summary=_summary(scenario, specimens, posterior, negligible),
        **given,
        variables={
            "scatter": posterior.t,
            "mean_ln_k": posterior.m,
            "posterior": posterior.density(),
            "ln_k": grid,
            "test_density": np.exp([log_density(kernel, grid) for kernel in kernels]),
            **_traces(rows),
        },
    )


def _three(quantiles: Sequence[float]) -> dict[str, float]:
    """Return a value with its 95 and 90 % intervals from five quantiles."""
    low, low_90, value, high_90, high = map(float, quantiles)
    return {"value": value, "low": low, "high": high, "low_90": low_90, "high_90": high_90}


def _test(row: Identified, specimen: Specimen) -> dict[str, Any]:
    """Return the numbers of one measured groove."""
    alone = np.exp(row.kernel.quantile(np.array(_FIVE))).tolist()
    names, fit = ("value", "low", "high"), row.fit
    noise = None if fit is None else fit.trace.noise
    return {
        "file": row.item.name,
        "specimen": specimen.name,
        "body": row.item.body,
        "angle_rad": row.item.angle,
        "quantity": "lift" if row.item.lift else "groove",
        "levelled_on": "a measured depth" if fit is None else fit.trace.levelled,
        "passes": row.passes,
        "depth_m": None if row.depth is None else row.depth[0],
        "depth_interval_m": None if row.depth is None else list(row.depth[1:]),
        "model_depth_m": row.model_depth[0],
        "model_depth_interval_m": list(row.model_depth[1:]),
        "area_m2": None if row.area is None else row.area[0],
        "area_interval_m2": None if row.area is None else list(row.area[1:]),
        "k_over_h_per_Pa": _three(alone),
        "energy_J": dict(zip(names, row.energy, strict=True)),
        "share_of_inputs": row.kernel.variance_of_inputs / row.kernel.variance,
        "shares": dict(row.shares),
        "effective_draws": row.kernel.effective_size,
        "inclination_rad": None if fit is None else fit.trace.inclination,
        "noise_m": None if noise is None else noise.std,
        "noise_length_m": None if noise is None else noise.length,
        "residual_ratio": None if fit is None else fit.ratio,
        "residual_probability": None if fit is None else fit.probability,
        "residual_autocorrelation": None if fit is None else fit.correlation,
    }


def _summary(
    scenario: Scenario, specimens: Sequence[Specimen], posterior: Posterior, negligible: float
) -> dict[str, Any]:
    """Return scatter, verdict and what would decide."""
    kernels = [specimen.kernel for specimen in specimens]
    centres = np.array([kernel.mean for kernel in kernels])
    count = len(kernels)
    variance = float(np.mean([kernel.variance for kernel in kernels]))
    ratio = limit = None
    random = False
    if count > 1:
        design = Design(kernels, negligible=negligible, seed=scenario.seed)
        ratio, limit = design.ratio(centres), design.quantile
        random = ratio > limit
    upper = posterior.scatter([1.0 - ALPHA])[0]
    verdict = word(random, upper, negligible)
    exponents = {
        specimen.name: exponent(test)
        for specimen in specimens
        for test in specimen.tests
        if len(test) > 1
    }
    low, middle, high = posterior.next((0.025, 0.5, 0.975))
    return {
        "scatter_seen": float(centres.std(ddof=1)) if count > 1 else None,
        "scatter_from_inputs": variance**0.5,
        "scatter_of_k": _three(posterior.scatter(_FIVE)),
        "scatter_upper_95": upper,
        "negligible": negligible,
        "bayes_factor": posterior.bayes_factor(),
        "prior_scale": PRIOR_SCALE,
        "sensitivity": [
            {
                "prior_scale": scale,
                "bayes_factor": posterior.bayes_factor(scale),
                "scatter_of_k": posterior.scatter([0.5], scale)[0],
            }
            for scale in PRIORS
        ],
        "likelihood_ratio": ratio,
        "likelihood_ratio_95": limit,
        "verdict": verdict,
        "scatter_detected": random,
        "k_over_h_median_per_Pa": _three(np.exp(posterior.mean(_FIVE)).tolist()),
        "next_specimen": {
            "median_per_Pa": float(np.exp(middle)),
            "low_per_Pa": float(np.exp(low)),
            "high_per_Pa": float(np.exp(high)),
            "factor": float(np.exp((high - low) / 3.92)),
        },
        "exponents": {
            name: dict(zip(("value", "low", "high"), fitted, strict=True))
            for name, fitted in exponents.items()
            if fitted is not None
        },
        "to_decide": _to_decide(specimens, negligible, scenario.seed, verdict),
    }


def _to_decide(
    specimens: Sequence[Specimen], negligible: float, seed: int, verdict: str
) -> dict[str, Any]:
    """Return what would decide, by simulated sets of such tests, as in `plan_tests`."""
    rows = [row for specimen in specimens for test in specimen.tests for row in test]
    shares: dict[str, float] = {}
    for row in rows:
        for key, part in row.shares.items():
            shares[key] = shares.get(key, 0.0) + part / len(rows)
    measure = [key for key, part in sorted(shares.items(), key=lambda item: -item[1]) if part > 0.1]
    count, kernels = len(specimens), [specimen.kernel for specimen in specimens]
    known = float(np.mean([k.variance - k.variance_of_inputs for k in kernels]))
    measured = LikelihoodMixture(np.ones(1), np.zeros(1), np.array([np.sqrt(MEASURED**2 + known)]))
    now, then = (Power(k, negligible=negligible, seed=seed) for k in (kernels, [measured]))
    return {
        "scatter": SHOWN,
        "power": now.rates(count, SHOWN)[0] if count > 1 else 0.0,
        "tests": now.needed(SHOWN),
        "measure": measure[:3],
        "tests_if_measured": then.needed(SHOWN),
        "power_if_measured": then.rates(count, SHOWN)[0] if count > 1 else 0.0,
        "most_tests": MOST_TESTS,
        "needed": verdict == "undecided",
    }


def _warnings(specimens: Sequence[Specimen], rows: Sequence[Identified]) -> list[str]:
    """Return remarks on fits, on the number of draws and on missing random inputs."""
    few = [
        specimen.name
        for specimen in specimens
        if len(specimen.tests[0][0].likelihood.mean) > 1
        and specimen.kernel.effective_size < FEW_DRAWS
        and len(specimen.tests) == 1
    ]
    too_few = (
        f"{', '.join(few)}: fewer than {FEW_DRAWS:.0f} draws describe the shape of the groove;"
        " give more with --draws"
    )
    apart = [
        f"{specimen.name}: its grooves contradict each other (p = "
        f"{max(specimen.agreement, 1e-12):.1g}): no K/H describes them all, and that of the"
        " specimen and its interval are wrong; are they of one specimen, and their passes, inputs"
        " and errors right?"
        for specimen in specimens
        if specimen.agreement < _AGREEMENT
    ]
    certain = len(specimens) > 1 and all(len(row.likelihood.mean) == 1 for row in rows)
    return [
        *(text for row in rows if row.fit is not None for text in row.fit.warnings),
        *apart,
        *([too_few] if few else []),
        *([_NOTHING_RANDOM] if certain else []),
    ]


def _traces(rows: Sequence[Identified]) -> dict[str, FloatArray]:
    """Return all traces as rows of equal length, filled with NaN."""
    fits = [row.fit for row in rows]
    points = max([len(fit.trace.y) for fit in fits if fit is not None], default=1)
    names = ("y", "height", "fitted", "low", "high", "unworn")
    traces = {f"trace_{name}": np.full((len(rows), points), np.nan) for name in names}
    for place, fit in enumerate(fits):
        if fit is None:
            continue
        trace = fit.trace
        columns = (trace.y, trace.height, fit.fitted, fit.low, fit.high, trace.unworn)
        for name, column in zip(names, columns, strict=True):
            traces[f"trace_{name}"][place, : len(trace.y)] = column
    return traces
