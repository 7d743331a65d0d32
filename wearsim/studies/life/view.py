"""Views of lives: lives with intervals, probabilities, what moves them, and comparisons."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.report.text import (
    NOTHING,
    TOO_FEW_REALISATIONS,
    count,
    lapse,
    limit_unit,
    part_with_interval,
    rounded_lives,
    shown,
    too_few,
    with_ends,
    with_unit,
)
from wearsim.report.view import Overview, Row, Rows, Table
from wearsim.results.study_view import SAMPLING
from wearsim.studies.ensemble.view import RealisationsView, known_effects
from wearsim.studies.fatigue.lives import competing_data, competing_table, fatigue_of_lives
from wearsim.studies.life.fits_table import fit_tables, fits_data
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.values import remarks
from wearsim.units import kind_of
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.lives import fewest_lives, least_survival
from wearsim.uq.survival.rare_events import RareProbability
from wearsim.uq.survival.two_levels import UncertainLife

RARE_TESTS = 200  # that are proposed for a probability that is not stated
_SMALL = 0.01  # probability below which more digits are shown
ERROR = (
    f"{SAMPLING} The numerical error of the lives is stated beside them; it does not contain the"
    " error of the model."
)

_EFFECTS = "what moves the life: Sobol indices of its logarithm"


class LifeView(RealisationsView[LifeResult]):
    """Lives that percentages of the machines do not reach, with intervals and numerical errors.

    Panels: survival, probability plots, effects of the inputs, limits. Files: as of an ensemble.
    """

    verb, sheet = "life", "wearsim.studies.life.panels:life_sheet"
    basis = ERROR

    def __init__(self, result: LifeResult) -> None:
        super().__init__(result)
        self._limits = ", ".join(limit_texts(result.scenario.limit.given))
        self.question = (
            f"How many {result.unit} does the design last, until the first of: {self._limits}?"
        )
        self.warnings = (*result.warnings, *remarks(result))

    def rows(self) -> Rows:
        """Return the lives of the shares, B10 first, and the probability of the target."""
        result = self.result
        if result.count == 0:
            return [Row("life", "no test is completed")]
        bound = (
            f"at least {shown(least_survival(result.count), '%', 3)} survive {count(result.most)}"
            f" {result.unit}, with 95 % confidence"
        )
        is_refused = result.rare is not None and not result.rare.is_reliable
        return [
            *(
                Row(
                    f"B{share:g}",
                    life_text(result, share) + self._plug_in(share),
                    answers={f"b{share:g}": (result.b(share).value, "1")},
                )
                for share in sorted(result.settings.shares, key=lambda share: share != 10.0)
            ),
            *self._target_rows(),
            *(Row(f"by {name}", rare_text(item)) for name, item in result.rare_estimates.items()),
            *(
                [Row("small probability", "not stated; give a greater --rare")]
                if is_refused
                else []
            ),
            *([] if result.observed.any() or result.is_exact else [Row("no life ended", bound)]),
        ]

    def _target_rows(self) -> Rows:
        """Return the probability of a life before the target, or how a small one is found."""
        result, target = self.result, self.result.target
        if target is None:
            return []
        row = Row(
            f"P(life < {count(target)} {result.unit})",
            target_text(result),
            answers={"probability": (result.probability_before(target).value, "%")},
        )
        if not result.probability_obstacle(target) or result.rare or result.settings.alone:
            return [row]
        return [row, Row("tests that sample the other inputs", f"`{rare_command(result)}`")]

    def study(self) -> Rows:
        """Return rows on limits, realisations, wear factor, ends of the lives and effort."""
        result, settings = self.result, self.result.settings
        done = f"{count(result.count)} done, {count(result.failed)} failed"
        done += f", of {count(settings.plain)}" if result.requested > 1 else ""
        factor = f"lives are counted: {settings.reason}"
        if settings.factor:
            posterior = f", with its posterior given {_tests_of(result)}" if result.levels else ""
            alone = "; nothing else is random, so that one test is sufficient"
            factor = f"{settings.factor} is integrated exactly{posterior}{alone * settings.alone}"
        fresh = f"; {count(result.at_once)} reached a limit at once, when fresh"
        ends = (
            f"{count(int(result.observed.sum()))} ended by a limit, {count(result.censored)}"
            f" censored at {count(result.most)} {result.unit}{fresh if result.at_once else ''}"
        )
        return [
            Row("life", f"{result.unit} until the first of: {self._limits}"),
            Row("realisations", done if result.finished else f"{done}, unfinished"),
            Row("wear factor", factor),
            Row("lives", ends),
            *([Row("95 % intervals", result.method)] if result.count else []),
            *fatigue_of_lives(result),
            Row("contact model", result.described_model),
            Row("wall time", lapse(result.raw.wall_seconds)),
        ]

    def details(self) -> list[Table]:
        """Return numerical errors, fits, the limits that were first, and effects of the inputs."""
        result = self.result
        if not result.count:
            return []
        competing = competing_table(result, result.b_error)
        return [
            *([self._levels()] if result.uncertain is not None else []),
            lives_table([""], [result]),
            *([Table("", competing[1], competing[0])] if competing else []),
            *fit_tables(result),
            Table(
                "",
                [
                    [name.replace("_", " "), shown(share, "%", 3), self._angle(name)]
                    for name, share in result.first_limits.items()
                ],
                ["first limit", "share", ""],
            ),
            self.observables_table("at the end of the life"),
            self._effects(),
        ]

    def _plug_in(self, share: float) -> str:
        """Return the life with median and scatter of K/H taken as known; empty if they are."""
        life = self.result.uncertain_life(share)
        if life is None:
            return ""
        _, plug_in, _ = rounded_lives(life.low, life.plug_in, life.high)
        return f" given {_tests_of(self.result)}; plug-in {plug_in}"

    def _levels(self) -> Table:
        """Return predictive and plug-in lives, and what would reduce their uncertainty."""
        result = self.result
        lives = {share: result.uncertain_life(share) for share in result.settings.shares}
        return Table(
            "",
            [[f"B{share:g}", *_uncertain_cells(life)] for share, life in lives.items() if life],
            [
                f"life [{result.unit}], given {_tests_of(result)}",
                *("predictive", "plug-in", "95 % credible"),
                *("sd of ln life", "by more tests", "by more realisations"),
            ],
        )

    def _angle(self, name: str) -> str:
        """Return where on a cam a limit was reached, empty for other limits."""
        if name not in self.result.angles:
            return ""
        low, middle, high = np.degrees(np.quantile(self.result.angles[name], (0.05, 0.5, 0.95)))
        spread = f" (90 % in {low:.1f} to {high:.1f} deg)" if high - low > 0.05 else ""
        return f"at {middle:.1f} deg{spread}"

    def _effects(self) -> Table:
        """Return the Sobol indices of the life, and its change by each input."""
        result = self.result
        if why := self._no_effects():
            return Table("", [[f"{_EFFECTS}: {why}"]], [""])
        changes = result.tornado()
        return Table(
            "",
            [
                [
                    item.name,
                    f"not significant, at most {shown(item.first.high, '%', 2)}"
                    if item.without_effect
                    else part_with_interval(item.first),
                    *(
                        map(_change, changes[item.name].factors)
                        if item.name in changes
                        else (NOTHING, NOTHING)
                    ),
                ]
                for item in result.sensitivity("life")
            ],
            [_EFFECTS, "first order", "life, input at 10 %", "input at 90 %"],
        )

    def _no_effects(self) -> str:
        """Return why there are no effects, or an empty text."""
        result = self.result
        reasons = (
            (result.settings.alone, result.settings.factor),
            (result.count == 1, TOO_FEW_REALISATIONS),
            (result.are_equal, "nothing, no two lives differ"),
            (result.effects_obstacle, f"not stated\n{result.effects_obstacle}"),
        )
        for applies, reason in reasons:
            if applies:
                return reason
        return "" if known_effects(result, "life") else too_few(result.fewest_for_indices())

    def data(self) -> dict[str, Any]:
        """Return the life of the design, lives in its unit."""
        result, settings, target = self.result, self.result.settings, self.result.target
        probability = None
        if target is not None:
            obstacle = result.probability_obstacle(target)
            probability = {
                "target": target,
                **asdict(result.probability_before(target)),
                "not_stated_because": obstacle or None,
                "command": rare_command(result) if obstacle and not settings.rare else None,
            }
        return {
            "title": result.title,
            "unit": result.unit,
            "limits": result.scenario.limit.given,
            **competing_data(result),
            "realisations": result.count,
            "failed": result.failed,
            "errors": dict(result.errors),
            "censored": result.censored,
            "reached_at_once": result.at_once,
            "maximum": result.most,
            "variable": settings.variable or None,
            "finished": result.finished,
            "b": {f"{share:g}": _life_data(result, share) for share in settings.shares},
            "probability_before_target": probability,
            "rare": self._rare(),
            "first_limits": result.first_limits,
            "angles_deg": {name: np.degrees(angles) for name, angles in result.angles.items()},
            **fits_data(result),
            "sensitivity_of_life": [
                {"input": item.name, "first_order": asdict(item.first)}
                for item in (result.sensitivity("life") if result.count > 1 else [])
            ],
            "sensitivity_not_stated_because": result.effects_obstacle or None,
            "effects_on_life": [
                {
                    "input": name,
                    "sign": effect.sign,
                    "factor_at_10_percent": asdict(effect.factors[0]),
                    "factor_at_90_percent": asdict(effect.factors[1]),
                }
                for name, effect in ({} if result.are_equal else result.tornado()).items()
            ],
            "exact_wear_factor": settings.factor or None,
            "counted_because": settings.reason or None,
            "interval_method": result.method,
            "seed": result.raw.seed,
            "wall_seconds": result.raw.wall_seconds,
            **self.ending(),
            "warnings": list(result.warnings),
        }

    def _rare(self) -> dict[str, Any] | None:
        if self.result.rare is None:
            return None
        tried = {
            method: {
                **asdict(item),
                "probability": asdict(item.probability) if item.is_reliable else None,
                "refused": not item.is_reliable,
            }
            for method, item in self.result.rare_estimates.items()
        }
        method = next(reversed(tried))
        return {**tried[method], "method": method, "tried": tried}

    def overview(self) -> Overview:
        """Return the design with its loads, the lives with intervals, and what moves them."""
        from wearsim.studies.life.panels import life_overview  # noqa: PLC0415  (only of pages)

        result = self.result
        if not result.count:
            return life_overview(result, {}, "")
        lives = [
            Row(f"B{share:g}", _three_digits(result, share)) for share in result.settings.shares
        ]
        return life_overview(result, {"Life": lives}, self._no_effects())

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the study."""
        settings, until = self.result.settings, self.result.raw.until
        return [
            *study_options(self.result),
            *(["--precision", until] if until else []),
            *(
                ["--rare", str(settings.rare), "--rare-method", settings.rare_method]
                if settings.rare
                else []
            ),
        ]


def _three_digits(result: LifeResult, share: float) -> str:
    """Return a life and its interval with three digits, or why it is not stated."""
    life = result.b(share)
    if not math.isfinite(life.value):
        return life_text(result, share)
    value, low, high = (
        count(float(f"{end:.3g}")) if math.isfinite(end) else NOTHING
        for end in (life.value, life.low, life.high)
    )
    interval = f", 95 %: {low} to {high}" if life.low != life.high else ""
    return f"{value} {result.unit}{interval}"


def _uncertain_cells(life: UncertainLife) -> list[str]:
    """Return a life, its credible interval and the sources of its uncertainty as cells."""
    low, predictive, plug_in, high = rounded_lives(
        life.low, life.predictive, life.plug_in, life.high
    )
    cells, total = [predictive, plug_in, f"{low}..{high}"], life.by_tests + life.by_realisations
    if not (math.isfinite(life.low) and math.isfinite(life.high)):
        return [*cells, NOTHING, NOTHING, NOTHING]
    of_total = (
        shown(part / total, "%", 2) if total else NOTHING
        for part in (life.by_tests, life.by_realisations)
    )
    return [*cells, f"{math.sqrt(total):.2g}", *of_total]


def _life_data(result: LifeResult, share: float) -> dict[str, Any]:
    """Return a life with its interval and its numerical error for JSON."""
    (low, high), life = result.b_error(share), result.uncertain_life(share)
    return {
        **asdict(result.b(share)),
        "lower_bound": result.lower_bound(share) if not result.is_exact else None,
        "numerical_low": low,
        "numerical_high": high,
        **({} if life is None else {"given_tests": asdict(life)}),
    }


def _tests_of(result: LifeResult) -> str:
    """Return the wear tests of a posterior in words, "these 8 tests"."""
    count_ = result.levels.specimens if result.levels else 0
    return f"these {count_} specimens" if count_ else "these specimens"


def lives_table(labels: Sequence[str], results: Sequence[LifeResult]) -> Table:
    """Return lives, their intervals, and the lives with the numerical errors of the tests."""
    lines = [
        [f"{label} B{share:g}".strip(), *life_cells(result, share), _numerical(result, share)]
        for label, result in zip(labels, results, strict=True)
        for share in result.settings.shares
    ]
    return Table(
        "", lines, [f"life [{results[0].unit}]", "estimate", "95 % interval", "numerical error"]
    )


def _numerical(result: LifeResult, share: float) -> str:
    """Return the ends of the numerical error of a life, relative to it."""
    value = result.b(share).value
    parts = [
        100.0 * (end / value - 1.0) if value > 0.0 else math.nan for end in result.b_error(share)
    ]
    low, high = (f"{part:+.2g}" if part else "0" for part in parts)
    return f"{low}..{high} %" if all(map(math.isfinite, parts)) else NOTHING


def limit_texts(limits: Mapping[str, float]) -> list[str]:
    """Return limits of a life by name in SI units as texts, "depth 50.00 um"."""
    return [
        f"{name.replace('_', ' ')} {shown(value, limit_unit(name))}"
        for name, value in limits.items()
    ]


def life_text(result: LifeResult, share: float) -> str:
    """Return a life with its unit and its interval."""
    value, interval = life_cells(result, share)
    if math.isnan(result.b(share).value) and not interval:
        return value  # how many lives it takes
    return f"{value} {result.unit}" + (f" [{interval}]" if interval else "")


def life_cells(result: LifeResult, share: float) -> tuple[str, str]:
    """Return the life that a percentage does not reach, and its interval, which may be empty."""
    life, most = result.b(share), count(result.most)
    low, value, high = rounded_lives(life.low, life.value, life.high)
    if math.isnan(life.value):
        fewest = fewest_lives(0.01 * share)
        if result.count < fewest and not result.is_exact:
            return f"takes {fewest} lives", ""
        return f"above {most}", f"from {low}" if math.isfinite(life.low) else NOTHING
    if life.low == life.high:
        ends = result.b_error(share)
        return rounded_lives(ends[0], life.value, ends[1])[1], ""
    if math.isfinite(life.low):
        return value, f"{low}..{high}" if math.isfinite(life.high) else f"from {low}"
    bound = result.lower_bound(share)  # of a small sample
    return value, f"from {rounded_lives(bound)[0]} (one-sided)" if math.isfinite(
        bound
    ) else "too few lives"


def _change(factor: Interval) -> str:
    """Return a change of the life by an input, with its interval."""
    if not math.isfinite(factor.half_width):
        return NOTHING
    return with_ends(factor, lambda end: f"{100.0 * (end - 1.0):+.1f}", " %")


def study_options(result: LifeResult) -> list[str]:
    """Return the options of a study of lives but for precision and rare events."""
    return [
        *("-n", str(result.settings.plain), "--seed", str(result.raw.seed)),
        *("--b", ",".join(f"{share:g}" for share in result.settings.shares)),
        *("--max", f"{result.most:.17g}"),
        *(["--target", f"{result.target:.17g}"] if result.target is not None else []),
    ]


def rare_command(result: LifeResult) -> str:
    """Return the command for a small probability of a life before the target."""
    file = result.raw.scenario_file
    return shlex.join(
        [
            *("wearsim", "life", file, *study_options(result)),
            *_limit_options(result.scenario.limit.given),
            *("--rare", str(RARE_TESTS)),
            *("-o", f"{Path(file).stem.removesuffix('-life')}-rare-life.h5"),
        ]
    )


def _limit_options(limits: Mapping[str, float]) -> Iterator[str]:
    """Yield the options of limits of a life in SI, "--limit" and "depth=5e-05 m"."""
    for name, limit in limits.items():
        yield from ("--limit", with_unit(f"{name}={limit:.12g}", kind_of(limit_unit(name)).unit))


def target_text(result: LifeResult) -> str:
    """Return the probability of a life before the target, or why it is not stated."""
    assert result.target is not None
    if obstacle := result.probability_obstacle(result.target):
        return f"not stated: {obstacle}"
    chance = result.probability_before(result.target)
    if not 0.0 < chance.value < _SMALL:
        return part_with_interval(chance)
    ends = f" [{chance.low:.2g}, {chance.high:.2g}]" if chance.low < chance.high else ""
    return f"{chance.value:.3g}{ends}"


def rare_text(estimate: RareProbability) -> str:
    """Return the probability of a rare event, or why there is none."""
    if not estimate.is_reliable:
        return f"refused, {estimate.obstacle}"
    chance, size = estimate.probability, estimate.effective_size
    return (
        f"{chance.value:.3g} [{chance.low:.2g}, {chance.high:.2g}], {count(estimate.tests)} tests,"
        f" variation {shown(estimate.variation, '%', 2)}"
        + ("" if size is None else f", effective sample size {size:.0f}")
    )
