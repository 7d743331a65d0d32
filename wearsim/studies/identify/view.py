"""View of an identification: verdict, scatter and wear factors, traces, and repetition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import tomlkit

from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Axis,
    Band,
    Contours,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Text,
    dots,
    evenly_spaced,
    share_axis,
)
from wearsim.report.text import NOTHING, in_unit, lapse, shown, with_range
from wearsim.report.view import Column, Columns, Frame, Repetition, Row, Rows, Table
from wearsim.results.study_view import StudyView
from wearsim.studies.identify.planning import SCATTERS, PlannedDesign
from wearsim.studies.identify.result import IdentificationResult

_SCALE = 1e12  # K/H is shown in 1e-12 1/Pa
_HEADS = (
    "test",
    "levelled on",
    "measured depth [um]",
    "model's depth [um]",
    "area [mm^2]",
    "K/H [1e-12 1/Pa]",
    "residuals",
)

#: numbers of a groove: title in the CSV file, name, size in SI units, and SI unit
_NUMBERS = (
    ("passes", "passes", 1.0, "1"),
    ("depth [um]", "depth_m", 1e6, "m"),
    ("model_depth [um]", "model_depth_m", 1e6, "m"),
    ("K/H [1/Pa]", "k_over_h_per_Pa", 1.0, "1/Pa"),
    ("low [1/Pa]", "k_over_h_per_Pa_low", 1.0, "1/Pa"),
    ("high [1/Pa]", "k_over_h_per_Pa_high", 1.0, "1/Pa"),
)


class IdentificationView(StudyView[IdentificationResult]):
    """Verdict on the scatter of K/H, scatter seen and explained, K/H of the next specimen.

    Panels: wear factors, scatter, its density with the median, traces with their residuals. Files:
    tests and traces; the table of pandas has the tests.
    """

    verb = "identify"
    basis = (
        "Intervals hold 95 %. In full slip a groove shows the product of K/H and dissipated energy:"
        " a K/H holds for the stated energy. The error of the contact model is not contained."
    )

    def __init__(self, result: IdentificationResult) -> None:
        super().__init__(result)
        self.question = f"Which K/H do {len(result.tests)} measured grooves have, is K/H random?"

    def rows(self) -> Rows:
        """Return the verdict, scatter, sensitivity to the prior and what would decide."""
        result, summary = self.result, self.result.summary
        t, seen, bayes = (
            summary[name] for name in ("scatter_of_k", "scatter_seen", "bayes_factor")
        )
        following, ratio = summary["next_specimen"], summary["likelihood_ratio"]
        middle, decide = summary["k_over_h_median_per_Pa"], summary["to_decide"]
        sensitivity = "; ".join(
            f"{row['prior_scale']:g}: {row['bayes_factor']:.2f}, t {row['scatter_of_k']:.2f}"
            for row in summary["sensitivity"]
        )
        likelihood = (
            ""
            if ratio is None
            else f"{ratio:.2f}; 95 % of such tests stay below {summary['likelihood_ratio_95']:.2f}"
        )
        return [
            Row("verdict", result.verdict_words),
            Row("scatter of ln K/H seen", NOTHING if seen is None else f"{seen:.3f}"),
            Row("scatter that inputs explain", f"{summary['scatter_from_inputs']:.3f}"),
            Row(
                "scatter t of ln K/H itself",
                f"{t['value']:.2f} (90 %: {t['low_90']:.2f} to {t['high_90']:.2f};"
                f" 95 %: {t['low']:.2f} to {t['high']:.2f})",
                answers={"scatter_of_k": (t["value"], "1")},
            ),
            Row(
                "Bayes factor of t = 0",
                f"{bayes:.2f} against t ~ half-normal(0.5)",
                answers={"bayes_factor": (bayes, "1")},
            ),
            Row("by the scale of the prior", sensitivity),
            *([Row("likelihood ratio of t = 0", likelihood)] if likelihood else []),
            Row(
                "K/H, median of specimens",
                _wear_factor(middle, ("value", "low", "high")),
                answers={"k_over_h_median": (middle["value"], "1/Pa")},
            ),
            Row(
                "K/H, next specimen",
                _wear_factor(following, ("median_per_Pa", "low_per_Pa", "high_per_Pa")),
                answers={"k_over_h_next": (following["median_per_Pa"], "1/Pa")},
            ),
            Row(
                "what would decide" if decide["needed"] else "power of the tests",
                deciding(decide, len(result.raw.specimens)),
            ),
        ]

    def study(self) -> Rows:
        """Return energies, variance from inputs, growth with passes, and effort."""
        result = self.result
        parts = [round(100.0 * test["share_of_inputs"]) for test in result.tests]
        low, high = min(parts), max(parts)
        return [
            Row(
                "K/H holds for the energy",
                ", ".join(shown(test["energy_J"]["value"], "J", 3) for test in result.tests),
            ),
            Row(
                "variance of ln K/H from inputs",
                f"{high} %" if low == high else f"{low} to {high} %",
            ),
            *(
                Row(
                    f"depth of {name}",
                    f"~ passes^{exponent['value']:.3f} ({exponent['low']:.3f} to"
                    f" {exponent['high']:.3f}); {2.0 / 3.0:.3f} for rigid bodies in full slip"
                    " under a constant load",
                )
                for name, exponent in result.summary["exponents"].items()
            ),
            Row("wall time", lapse(result.raw.wall_seconds)),
        ]

    def details(self) -> list[Table]:
        """Return depth, area and wear factor of each groove."""
        return [Table("", [_cells(test) for test in self.result.tests], _HEADS)]

    def data(self) -> dict[str, Any]:
        """Return tests, scatter and verdict."""
        result = self.result
        return {
            "title": result.title,
            "tests": result.tests,
            "specimens": result.raw.specimens,
            **result.summary,
            "notes": result.notes,
            "warnings": result.warnings,
            "file": result.path,
            "wall_seconds": result.raw.wall_seconds,
        }

    def columns(self) -> Mapping[str, Columns]:
        """Return the tests, and all traces below each other."""
        tests, names = self._tests(), ("y", "height", "fitted", "low", "high")
        traces = [self.result.values(f"trace_{name}") for name in names]
        known = np.isfinite(traces[0])
        numbers = np.broadcast_to(np.arange(1.0, len(known) + 1.0)[:, None], known.shape)
        return {
            "tests.csv": [
                [
                    *(
                        Column(name, [test[name] for test in tests])
                        for name in ("file", "specimen")
                    ),
                    *(
                        Column(
                            title,
                            [
                                "" if test[key] is None else f"{size * test[key]:.12g}"
                                for test in tests
                            ],
                        )
                        for title, key, size, _ in _NUMBERS
                    ),
                ]
            ],
            "traces.csv": [
                [
                    Column("test", numbers[known]),
                    *(
                        Column(name, trace[known], *unit)
                        for name, trace, unit in zip(
                            names, traces, (("mm", 1e-3), *[("um", 1e-6)] * 4), strict=True
                        )
                    ),
                ]
            ],
        }

    def frame(self) -> Frame:
        """Return the tests, one row for each groove."""
        tests = self._tests()
        units = {"file": "", "specimen": "", **{name: unit for _, name, _, unit in _NUMBERS}}
        values = {
            name: np.array([np.nan if test[name] is None else test[name] for test in tests])
            for name in (*units, "energy_J")
        }
        columns = [(name, units.get(name, "J"), column) for name, column in values.items()]
        return Frame(columns, "groove", range(1, len(tests) + 1))

    def _tests(self) -> list[dict[str, Any]]:
        """Return the tests with one entry for each end of an interval."""
        return [
            {
                **test,
                "k_over_h_per_Pa": test["k_over_h_per_Pa"]["value"],
                "k_over_h_per_Pa_low": test["k_over_h_per_Pa"]["low"],
                "k_over_h_per_Pa_high": test["k_over_h_per_Pa"]["high"],
                "energy_J": test["energy_J"]["value"],
            }
            for test in self.result.tests
        ]

    def repetition(self) -> Repetition:
        """Return files, command and remark that repeat the study."""
        raw, (command, files, remark) = self.result.raw, super().repetition()
        if not raw.measured:
            return Repetition(
                command,
                files,
                "The results file holds neither the measured profiles nor the tests file and"
                " options, such as --tests, --columns and --draws: put the profiles beside these"
                " files, and add the options of the study. An identification that is repeated"
                " stores them.",
            )
        files = {**files, self._tests_file: tomlkit.dumps({"test": raw.measured})}
        names = ("profile", "lift", "before")
        profiles = dict.fromkeys(test[key] for test in raw.measured for key in names if key in test)
        if profiles:
            remark = (
                "The measured profiles are not stored in the results file; these files are needed"
                f" too, beside {self._tests_file}: {', '.join(profiles)}. {remark}"
            )
        return Repetition(command, files, remark)

    @property
    def _tests_file(self) -> str:
        return f"{Path(self.result.raw.scenario_file).stem}-tests.toml"

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the study."""
        raw = self.result.raw
        if not raw.measured:
            return [_name(test["file"]) for test in self.result.tests]
        return [
            *("--tests", self._tests_file),
            *("--negligible", f"{self.result.summary['negligible']!r}"),
            *(["--draws", str(raw.draws)] if raw.draws is not None else []),
            *(["--share", "k=cylinder,roller"] if raw.shared else []),
        ]

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return K/H of each specimen, density of m and t, and traces with their residuals."""
        result, drawn = self.result, {"factors": _factors, "scatter": _scatter, "density": _density}
        panels = {name: panel(result) for name, panel in drawn.items()}
        traced = np.flatnonzero(np.isfinite(result.values("trace_y")[:, 0])).tolist()
        for place in traced[:MOST_TRACES]:
            panels[f"trace {place}"], panels[f"residual {place}"] = _trace(result, place)
        columns, rows, heights = traced[:_IN_FIGURE], [["factors", "density"]], [1.0]
        if traced:
            upper = ([f"{name} {place}" for place in columns] for name in ("trace", "residual"))
            rows, heights = [*upper, *rows], [0.75, 0.35, 1.0]
        return Sheet(
            f"{result.title}\n{result.verdict_words}",
            panels,
            rows,
            (max(4.2 * len(columns), 9.6), 8.6 if traced else 4.2),
            heights=heights,
        )


def _name(file: str) -> str:
    return file.rpartition("/")[2]


def _wear_factor(factor: Mapping[str, float], names: Sequence[str]) -> str:
    """Return a wear factor with its interval."""
    value, *ends = (factor[name] for name in names)
    return f"{with_range(value, ends, _SCALE)} 1e-12 1/Pa"


def _cells(test: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the cells of a measured groove."""
    measured, area, k = (
        test[name] for name in ("depth_interval_m", "area_interval_m2", "k_over_h_per_Pa")
    )
    residuals = (
        NOTHING
        if test["residual_ratio"] is None
        else (
            f"tilt {1e3 * test['inclination_rad']:.2g} mrad, {test['residual_ratio']:.2f}"
            f" (p {test['residual_probability']:.2f}), r1 {test['residual_autocorrelation']:.2f}"
        )
    )
    return (
        _name(test["file"]),
        test["levelled_on"],
        NOTHING if measured is None else with_range(test["depth_m"], measured, 1e6),
        with_range(test["model_depth_m"], test["model_depth_interval_m"], 1e6),
        NOTHING if area is None else with_range(test["area_m2"], area, 1e6),
        with_range(k["value"], (k["low"], k["high"]), _SCALE),
        residuals,
    )


def deciding(decision: Mapping[str, Any], tests: int) -> str:
    """Return what would decide, in words.

    Parameters
    ----------
    decision : mapping of str to object
        "to_decide" of the JSON output.
    tests : int
        Number of tests at hand.
    """
    many = decision["tests"] or f"more than {decision['most_tests']}"
    now = f"{decision['power']:.2f} by these {tests} tests" if tests > 1 else "0 by one test"
    text = (
        f"a scatter of {decision['scatter']:g} is seen with probability {now}, and 0.8 by {many}"
        " such tests"
    )
    if not decision["tests_if_measured"] or decision["power_if_measured"] <= decision["power"]:
        return text
    return (
        f"{text}\nwith {', '.join(decision['measure']) or 'all inputs'} measured, so that inputs"
        f" leave 0.1: {decision['power_if_measured']:.2f}, and 0.8 by"
        f" {decision['tests_if_measured']} tests"
    )


_IN_FIGURE, MOST_TRACES, MOST_POINTS = 6, 12, 1200
_MASSES = (0.95, 0.9, 0.5)
_SHADES = ("#d6e4f2", "#a9c7e4", "#6f9fce")
_UNIT: dict[str, Any] = {"unit": "1e-12 1/Pa", "per_si": 1e12}  # of K/H


def depth_text(name: str, ends: Sequence[float]) -> str:
    """Return the interval of a depth after its name."""
    return f"{name} {in_unit(ends[0], 'um')} to {shown(ends[1], 'um')}"


def _trace(result: IdentificationResult, place: int) -> tuple[Panel, Panel]:
    """Return a trace against the band of the model, and its residuals."""
    names, test = ("y", "height", "fitted", "low", "high", "unworn"), result.tests[place]
    rows = [result.values(f"trace_{name}")[place] for name in names]
    known = np.flatnonzero(np.isfinite(rows[0]))
    every = known[evenly_spaced(len(known), MOST_POINTS)]
    y, height, fitted, low, high, unworn = (row[every] for row in rows)
    free, noise = unworn > 0.5, test["noise_m"] or 0.0
    text = depth_text("Model's depth", test["model_depth_interval_m"])
    if test["depth_interval_m"] is not None:
        text = f"{depth_text('Measured depth', test['depth_interval_m'])}. {text}"
    ends = float(y.min()), float(y.max())
    x, name = Axis("y", "mm", limits=ends), "height"
    if test.get("quantity") == "lift":
        x, name = Axis("angle", "deg", limits=ends), "change of the lift"
    upper = Panel(
        f"{_name(test['file'])}: K/H {1e12 * test['k_over_h_per_Pa']['value']:.3g}e-12 1/Pa",
        x,
        Axis(name, "um"),
        [
            dots(y, height, ".", size=2.0, colour=GREY, label="measured"),
            dots(y[free], height[free], ".", size=2.0, colour=GREEN, label="shoulders"),
            Band(y, low, high, colour=ORANGE, alpha=0.4, label="95 % band"),
            Line(y, fitted, width=1.0, label="best profile"),
        ],
        f"{text}.",
        legend="lower right",
    )
    residuals: list[Mark] = [
        Line(y, height - fitted, colour=GREY, width=0.6),
        Span(-2.0 * noise, 2.0 * noise, across="y", colour=GREEN, alpha=0.15),
    ]
    return upper, Panel("", x, Axis("residual", "um"), residuals, figure_only=True)


def _factors(result: IdentificationResult) -> Panel:
    """Return K/H of each specimen with its density, and the distribution of the next one."""
    k, following = np.exp(result.ln_k), result.summary["next_specimen"]
    std, middle = np.log(following["factor"]), np.log(following["median_per_Pa"])
    named: list[tuple[str, Any, str, float]] = [
        *(
            (name, density, BLUE, 0.35)
            for name, density in zip(result.raw.specimens, result.test_density, strict=True)
        ),
        ("next specimen", np.exp(-0.5 * ((result.ln_k - middle) / std) ** 2), ORANGE, 0.5),
    ]
    marks: list[Mark] = []
    for row, (name, density, colour, alpha) in enumerate(named):
        curve = row + 0.8 * density / density.max()
        marks += [
            Band(k, np.full_like(k, row), curve, colour=colour, alpha=alpha),
            Text(0.01, row + 0.1, _name(name), parts="x", colour=BLACK),
        ]
    below = np.cumsum(result.test_density, axis=1)
    below /= below[:, -1:]
    low = min(k[row.searchsorted(1e-3)] for row in below)
    high = max(k[min(row.searchsorted(0.999), len(k) - 1)] for row in below)
    return Panel(
        "K/H of each specimen, and of the next one",
        Axis("K/H", log=True, limits=(0.8 * low, 1.25 * high), **_UNIT),
        Axis(ticks=(), limits=(-0.1, len(named) + 0.1)),
        marks,
        "Density of the wear factor of each specimen, and of the next one.",
    )


def _scatter(result: IdentificationResult) -> Panel:
    """Return the density of the scatter of ln K/H, for a page."""
    t, ends = result.scatter, result.scatter_of_k
    density = (result.posterior * np.gradient(result.values("mean_ln_k"), axis=1)).sum(axis=1)
    density /= np.trapezoid(density, t)
    return Panel(
        "Scatter of the wear factor itself",
        Axis("scatter t of ln K/H", limits=(0.0, max(1.3 * ends["high"], 0.3))),
        Axis("probability density", limits=(0.0, None)),
        [
            Band(t, np.zeros_like(t), density),
            Line(t, density),
            Span(float(result.summary["negligible"]), dash="--", colour=GREY),
        ],
        f"95 %: {ends['low']:.2f} to {ends['high']:.2f}. Dashed: a negligible scatter.",
    )


def _density(result: IdentificationResult) -> Panel:
    """Return areas of the density of m and t that hold 50, 90 and 95 %."""
    t, m, density = result.scatter, result.values("mean_ln_k"), result.posterior
    weight = density * np.gradient(t)[:, None] * np.gradient(m, axis=1)
    order = np.argsort(-density, axis=None)
    held = np.cumsum(weight.ravel()[order])
    held /= held[-1]
    levels = [float(density.ravel()[order][held.searchsorted(mass)]) for mass in _MASSES]
    rows, median = np.broadcast_to(t[:, None], m.shape), np.exp(m)
    top = max(1.3 * result.scatter_of_k["high"], 0.3)
    inside = median[(density > levels[0]) & (rows < top)]
    limits = (0.9 * float(inside.min()), 1.1 * float(inside.max()))
    return Panel(
        "Median and scatter of K/H: 50, 90 and 95 %",
        Axis("median of K/H", log=True, limits=limits, **_UNIT),
        Axis("scatter t of ln K/H (dashed: negligible)", limits=(0.0, top)),
        [
            Contours(median, rows, density, [*levels, density.max()], _SHADES, outlined=True),
            Span(result.summary["negligible"], across="y", dash="--", width=0.8, colour=GREY),
        ],
        figure_only=True,
    )


def power_sheet(designs: Sequence[PlannedDesign], title: str = "") -> Sheet:
    """Return the power of planned tests against their number."""
    panels = {}
    for number, design in enumerate(designs):
        rates = {
            "'random' though t = 0" if t == 0.0 else f"'random', t = {t:g}": design.random[t]
            for t in (0.0, *SCATTERS)
        }
        marks: list[Mark] = [
            *(
                Line(design.tests, rate, marker="o", size=3.5, colour=colour, label=label)
                for (label, rate), colour in zip(rates.items(), (GREY, *COLOURS), strict=False)
            ),
            Line(
                design.tests, design.explained[0.0], dash="--", marker="s", size=3.5, colour=RED,
                label="'explained', t = 0",
            ),
            Span(0.8, across="y", dash=":", width=0.8, colour=GREY),
        ]  # fmt: skip
        panels[design.name] = Panel(
            fill(f"Inputs {design.name}", 56),
            Axis("number of tests", log=True),
            share_axis("" if number else "rate of the verdict"),
            marks,
            "Rates of the verdicts by the number of tests.",
            legend="" if number else "best",
        )
    return Sheet(title, panels, [list(panels)], (4.9 * len(designs) + 0.4, 4.2))
