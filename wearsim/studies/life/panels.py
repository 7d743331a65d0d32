"""Panels of lives: survival, probability plots, effects, limits, a sweep, and the overview."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    DASHES,
    Axis,
    Band,
    Bars,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Text,
    Whiskers,
    dots,
    evenly_spaced,
    message,
    several_colours,
    share_axis,
)
from wearsim.report.text import count, shown
from wearsim.report.view import Overview, Row, Rows
from wearsim.studies.cam.panels import ANGLE, shape_panel
from wearsim.studies.cam.turn import unchecked_turn_of
from wearsim.studies.cam.view import CAM_EXCLUDED, loads
from wearsim.studies.ensemble.panels import draws_panels, effects_panel
from wearsim.studies.ensemble.view import known_effects
from wearsim.studies.fatigue.panels import incidence_panel
from wearsim.studies.fatigue.view import source_text
from wearsim.studies.life.comparison import swept_variable
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.stored_settings import DesignVariable
from wearsim.studies.run.view import excluded_effects
from wearsim.types import FloatArray
from wearsim.units import engineers_unit
from wearsim.uq.estimation.intervals import arrays_of
from wearsim.uq.survival.fits import FAMILIES, Family, FittedLives, standard_score
from wearsim.uq.survival.lives import cumulative_incidence, median_positions

_WIDTH = 14.0  # of a figure with three columns [in]
_POINTS = 200  # of a curve
_MOST_MARKS = 500
_PERCENT = (0.1, 1.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0, 99.9)
_DARK, _PALE = "0.3", "0.85"


@dataclass(frozen=True)
class _Design:
    """A design with its label and colour; `several` if it is one of several."""

    result: LifeResult
    label: str
    colour: str
    several: bool

    @property
    def named(self) -> str:
        """Label in a legend, empty for one design alone."""
        return self.label if self.several else ""

    def words(self, name: str) -> str:
        """Return the name of a limit, after the label of one of several designs."""
        words = name.replace("_", " ")
        return f"{self.label}: {words}" if self.several else words


def life_sheet(result: LifeResult, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of the lives of one design."""
    return lives_sheet([result], [result.title])


def lives_sheet(results: Sequence[LifeResult], labels: Sequence[str]) -> Sheet:
    """Return the panels of the lives of designs.

    Parameters
    ----------
    results : sequence of LifeResult
        One design, or several with the same unit of life.
    labels : sequence of str

    Returns
    -------
    Sheet
        Survival with its 95 % band and ticks where lives are censored; probability plots on the
        scales of both fits; the effect of each input; the limits that were reached first, for a
        cam by angle; for a sweep also the lives against the design variable, with fatigue the
        incidences of wear and of pitting. Sources of constants are in the title.
    """
    several, axis = len(results) > 1, Axis("life", results[0].unit, 1.0)
    designs = [
        _Design(*triple, several)
        for triple in zip(results, labels, several_colours(len(results)), strict=True)
    ]
    variable = swept_variable(results)
    wide = {} if variable is None else {"against": _against(results, variable)}
    if any(result.raw.fatigue for result in results):
        wide["wear or pitting"] = incidence_panel(
            [(design.result, design.named, design.colour) for design in designs], axis
        )
    panels: dict[str, Panel] = {
        "survival": _survival(designs, axis),
        **{family: _probabilities(designs, family, axis) for family in FAMILIES},
        "tornado": _tornado(designs),
        "incidence": _incidence(designs, axis),
        "limits": _limits(designs),
        **wide,
    }
    rows = [["survival", *FAMILIES, *wide], ["tornado", "incidence", "limits", *wide]]
    result = results[0]
    if not (several or result.are_equal or result.settings.alone):
        if effects := known_effects(result, "life"):
            title = "What the scatter of the life is due to (Sobol indices)"
            panels["indices"] = effects_panel(title, "ln life", effects)
        panels |= draws_panels(result, "life", result.lives, axis)
    title = result.title if len({result.title for result in results}) == 1 else "lives of designs"
    sources = dict.fromkeys(source_text(result.scenario) for result in results)
    return Sheet(
        "\n".join(filter(None, [title, *sources])),
        panels,
        rows,
        (_WIDTH * (len(rows[0]) / 3.0), 8.4),
    )


def _against(results: Sequence[LifeResult], variable: DesignVariable) -> Panel:
    """Return the lives of the shares with their intervals against the variable of a sweep."""
    unit, size = engineers_unit(variable.unit)
    by_value = sorted(
        ((result.variable.value, result) for result in results if result.variable),
        key=lambda pair: pair[0],
    )
    shares, marks = results[0].settings.shares, list[Mark]()
    for share, colour in zip(shares, several_colours(len(shares)), strict=True):
        lives = {value: result.b(share) for value, result in by_value}
        known = {value: life for value, life in lives.items() if np.isfinite(life.value)}
        if not known:
            continue
        value, *ends = arrays_of(known.values())
        low, high = (np.where(np.isfinite(end), end, np.nan) for end in ends)
        marks += [
            Whiskers(tuple(known), low, high, colour=colour),
            Line(tuple(known), value, marker="o", colour=colour, label=f"B{share:g}"),
        ]
    if not marks:
        return message("Life against the design", "all lives are censored")
    return Panel(
        "Life, with 95 % intervals",
        Axis(variable.key, unit, 1.0 / size),
        Axis("life", results[0].unit, 1.0, limits=(0.0, None)),
        marks,
        f"Lives, with their 95 % intervals, against {variable.key}.",
    )


def _survival(designs: Sequence[_Design], axis: Axis) -> Panel:
    """Return the survival of designs with its 95 % band, censored lives and target."""
    if all(design.result.at_once == design.result.count for design in designs):
        return message("Survival", "every life is 0")
    marks: list[Mark] = [
        Span(1.0 - share, across="y", colour=_PALE, width=0.8) for share in (0.1, 0.5)
    ]
    for design in designs:
        result, colour = design.result, design.colour
        curve, steps = result.survival_curve(), not result.is_exact
        marks += [
            Band(curve.life, curve.low, curve.high, steps=steps, colour=colour, alpha=0.2),
            Line(curve.life, curve.survival, steps=steps, colour=colour, label=design.named),
        ]
        if result.censored:
            end, words = float(curve.survival[-1]), f"{result.censored} censored"
            marks += [
                dots([result.most], [end], "|", size=12.0, colour=colour),
                Text(result.most, end, words, "", (-4.0, 6.0), "right", colour=colour),
            ]
    text = "Share of the machines that outlast a life, with its 95 % band."
    for target in {design.result.target for design in designs}:
        if target is not None:
            marks += [
                Span(target, dash=":", colour="0.4"),
                Text(target, 0.02, "target", colour=BLACK, offset=(3.0, 0.0), size=9.0),
            ]
            text += f" Dotted: the target of {count(target)} {axis.unit}."
    return Panel(
        "Survival, with 95 % band",
        Axis(axis.name, axis.unit, axis.per_si, limits=(0.0, None)),
        share_axis("survival"),
        marks,
        text,
    )


def _scale(family: Family) -> Callable[[FloatArray], FloatArray]:
    from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

    return ndtri if family == "log-normal" else lambda p: np.log(-np.log1p(-p))


def _probabilities(designs: Sequence[_Design], family: Family, axis: Axis) -> Panel:
    """Return lives on the probability scale of a family, on which its fit is a straight line."""
    scale, ends, marks = _scale(family), list[float](), list[Mark]()
    title = f"{family[:1].upper()}{family[1:]} probability plot"
    for design in designs:
        result, colour = design.result, design.colour
        lives = np.sort(result.lives[result.observed & (result.lives > 0.0)])
        if not len(lives):
            continue
        part = median_positions(result.count)[result.at_once :][: len(lives)]
        picks = evenly_spaced(len(lives), _MOST_MARKS)
        marks.append(dots(lives[picks], scale(part[picks]), ".", colour=colour, label=design.label))
        ends += [float(lives[0]), float(lives[-1])]
        first, last = 0.7 * lives[0], 1.3 * lives[-1]
        if result.settings.alone:  # one test, which is a point of the distribution
            first, last = (result.distribution.quantile_of_mean(p) for p in (0.002, 0.998))
            ends += [first, last]
        across = np.geomspace(first, last, _POINTS)
        fits: Sequence[FittedLives] = result.integrated_fits or result.fits
        marks += [
            mark
            for fit in fits
            if fit.family == family
            for mark in _fit_marks(fit, across, colour, is_best=fit is fits[0])
        ]
        if result.is_exact:
            mean = np.clip(result.distribution.failed(across).mean(axis=0), 1e-4, 1.0 - 1e-4)
            marks.append(Line(across, scale(mean), ":", width=0.9, colour=_DARK, label="exact K/H"))
    if not ends:
        return message(title, "no life above 0 ended")
    low, high = (float(value) for value in scale(np.array([5e-4, 0.9995])))
    return Panel(
        title,
        Axis("life", axis.unit, 1.0, log=True, limits=(0.75 * min(ends), 1.3 * max(ends))),
        Axis(
            "failed [%]",
            limits=(low, high),
            ticks=scale(np.array(_PERCENT) / 100.0).tolist(),
            names=[f"{tick:g}" for tick in _PERCENT],
        ),
        marks,
        f"Lives on a scale on which a {family} distribution is a straight line; of the fit with its"
        " 95 % band.",
    )


def _fit_marks(fit: FittedLives, life: FloatArray, colour: str, *, is_best: bool) -> list[Mark]:
    """Return a fit on its own probability scale, with its pointwise 95 % band."""
    score, reach = fit.score(life), 1.96 * fit.score_error(life)
    low, high = (standard_score(fit.family, p) for p in (1e-4, 1.0 - 1e-4))
    inside = (score > low) & (score < high)
    life, score, reach = life[inside], score[inside], reach[inside]
    dash, label = ("-", "fit, lower AIC") if is_best else ("--", "fit")
    band = Band(life, score - reach, score + reach, colour=colour, alpha=0.15)
    return [
        Line(life, score, dash=dash, width=1.4, colour=colour, label=label),
        *([band] if reach.any() else []),
    ]


def _tornado(designs: Sequence[_Design]) -> Panel:
    """Return how far each input moves the life from its median, and the 95 % intervals."""
    title, results = "What moves the life", [design.result for design in designs]
    effects = [{} if result.are_equal else result.tornado() for result in results]
    names = list(dict.fromkeys(name for by_input in effects for name in by_input))
    if not names:
        alone = {result.settings.factor for result in results if result.settings.alone}
        text = f"only {', '.join(alone)}" if alone else "too few realisations, or equal lives"
        lines = [line for result in results for line in result.effects_obstacle.split("; ") if line]
        return message(title, *(lines or [text]))
    height, marks = 0.7 / len(designs), list[Mark]()
    for number, (by_input, design) in enumerate(zip(effects, designs, strict=True)):
        middle = (number - 0.5 * (len(designs) - 1)) * height
        places = np.array([names.index(name) for name in by_input], dtype=float) + middle
        edges = places - 0.5 * height, places + 0.5 * height
        for end, (alpha, label) in enumerate(((0.35, ""), (0.8, design.named))):
            value, low, high = arrays_of(effect.factors[end] for effect in by_input.values())
            marks += [
                Bars(*edges, value, 1.0, True, label=label, colour=design.colour, alpha=alpha),
                Whiskers(places, low, high, horizontal=True, colour="0.2"),
            ]
    name = "factor of the life, input at its 10 % (pale) and 90 % quantile"
    return Panel(
        title,
        Axis(name, margin=(0.05, 0.05)),
        Axis(ticks=range(len(names)), names=names, limits=(len(names) - 0.5, -0.5)),
        [*marks, Span(1.0, colour=_DARK, width=0.8)],
        f"{names[0]} moves the life most.",
    )


def _incidence(designs: Sequence[_Design], axis: Axis) -> Panel:
    """Return the share that each limit has ended, against the life."""
    title, marks = "Share ended by each limit", list[Mark]()
    for design in designs:
        result = design.result
        cause = np.where(result.observed, result.values("first_limit"), -1).astype(np.int64)
        ends, incidence = cumulative_incidence(
            np.minimum(result.lives, result.most), cause, len(result.limits)
        )
        marks += [
            Line(
                *(np.append(0.0, ends), np.append(0.0, share), dash),
                steps=True,
                colour=design.colour,
                label=design.words(name),
            )
            for name, share, dash in zip(result.limits, incidence, cycle(DASHES), strict=False)
            if len(ends) and share[-1] > 0.0
        ]
    if not marks:
        return message(title, "no limit was reached")
    return Panel(
        title,
        Axis(axis.name, axis.unit, axis.per_si, limits=(0.0, None)),
        share_axis("ended"),
        marks,
        "Share of the machines whose life has ended at each limit.",
    )


def _limits(designs: Sequence[_Design]) -> Panel:
    """Return which limit was first: of cams by angle, else as bars."""
    if any(design.result.angles for design in designs):
        edges: FloatArray = np.radians(5.0 * np.arange(73))
        return Panel(
            "Angle at which the limit is reached",
            ANGLE,
            Axis("share", "%", limits=(0.0, None)),
            [
                Bars(
                    *(edges[:-1], edges[1:]),
                    np.histogram(angles % (2.0 * np.pi), edges)[0] / design.result.count,
                    colour=design.colour,
                    alpha=0.8 - 0.4 * (number % 2),
                    label=design.words(name),
                )
                for design in designs
                for number, (name, angles) in enumerate(design.result.angles.items())
            ],
            "Share of the machines by the angle at which the limit was reached.",
        )
    if not any(design.result.observed.any() for design in designs):
        return message("Limit reached first", "no limit was reached")
    names = list(dict.fromkeys(name for design in designs for name in design.result.first_limits))
    width, bars = 0.7 / len(designs), list[Mark]()
    for number, design in enumerate(designs):
        shares = [design.result.first_limits.get(name, 0.0) for name in names]
        left = np.arange(len(names)) + (number - 0.5 * len(designs)) * width
        bars.append(
            Bars(left, left + width, shares, colour=design.colour, alpha=0.8, label=design.named)
        )
    return Panel(
        "Limit reached first",
        Axis(
            ticks=range(len(names)),
            names=[name.replace("_", " ") for name in names],
            limits=(-1.0, max(len(names), 1.0)),
        ),
        share_axis("share"),
        bars,
        "Share of the machines by the limit that they reached first.",
    )


def life_overview(result: LifeResult, lives: Mapping[str, Rows], no_effects: str) -> Overview:
    """Return what a page shows first: the design, its loads, limits, lives and what moves them.

    Parameters
    ----------
    result : LifeResult
    lives : mapping of str to list of Row
        Rows on the lives, by their title.
    no_effects : str
        Why there are no effects of the inputs, or an empty text.
    """
    scenario, groups = result.scenario, dict[str, Rows]()
    excluded = excluded_effects(bool(result.raw.fatigue))
    if scenario.cam is None:
        main = life_sheet(result).first
    else:
        groups["Loads"], main = loads(scenario), shape_panel(unchecked_turn_of(scenario))
        excluded += CAM_EXCLUDED
    if result.count:
        shares = {name: result.first_limits.get(name, 0.0) for name in scenario.limit.given}
        groups["First limit"] = [
            Row(name.replace("_", " "), f"the first in {shown(share, '%', 3)} of the tests")
            for name, share in shares.items()
        ]
        title = "What moves the life (with the input at its 10 % and 90 % quantile)"
        groups |= {**lives, title: _movers(result, no_effects)}
    return Overview(main, groups, excluded)


def _movers(result: LifeResult, no_effects: str) -> Rows:
    """Return the inputs with the greatest effects on the life, at most three."""
    if no_effects:
        return [Row("inputs", no_effects.replace("\n", ": "))]
    effects = [item for item in result.sensitivity("life") if not item.without_effect]
    changes, rows = result.tornado(), list[Row]()
    for item in sorted(effects, key=lambda item: -item.first.value)[:3]:
        text = f"{shown(item.first.value, '%', 2)} of the scatter"
        if item.name in changes:
            low, high = (factor.value - 1.0 for factor in changes[item.name].factors)
            text += f"; life {100.0 * low:+.0f} %, {100.0 * high:+.0f} %"
        rows.append(Row(item.name, text))
    return rows or [Row("inputs", "none significantly")]
