"""Part of the page on an identification of the wear factor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from bokeh.models.ranges import Range1d

from wearsim.report.page.part import SAME_NUMBERS, Part, command_of, files_of, tables_of
from wearsim.report.page.plots import COLOURS, UM, Plot, axes, columns, hover, legend
from wearsim.report.parts import BLUE, GREY, ORANGE, evenly_spaced
from wearsim.report.summary import with_range
from wearsim.report.text import PER_SI, in_unit, shown
from wearsim.results.identification import IdentificationResult

MOST_TRACES, MOST_POINTS = 12, 1200
_SCALE = 1e12  # K/H is shown in 1e-12 1/Pa
_ERROR = (
    "Intervals hold 95 %. In full slip a groove shows the product of K/H and dissipated energy: a"
    " K/H holds for the stated energy. The error of the contact model is not contained."
)


def of_identification(result: IdentificationResult) -> Part:
    """Return the part of the page on an identification."""
    found, scatter = result.summary, result.scatter_of_k
    middle, following = found["k_over_h_median_per_Pa"], found["next_specimen"]
    seen, ends = found["scatter_seen"], _ends(scatter["low"], scatter["high"])
    answer = [
        ("Is K/H random?", result.verdict_words),
        (
            "scatter t of ln K/H",
            f"{scatter['value']:.2f} ({ends})",
        ),
        ("scatter of ln K/H seen", "-" if seen is None else f"{seen:.3f}"),
        ("scatter that inputs explain", f"{found['scatter_from_inputs']:.3f}"),
        ("Bayes factor of t = 0", f"{result.bayes_factor:.2f}"),
        ("K/H, median of specimens", _factor(middle["value"], middle["low"], middle["high"])),
        ("K/H, next specimen", _factor(*(following[name] for name in _NEXT))),
    ]
    tests = []
    for test in result.tests:
        k = test["k_over_h_per_Pa"]
        depths = _depth("model's depth", test["model_depth_interval_m"])
        if test["depth_interval_m"] is not None:
            depths = f"{_depth('measured depth', test['depth_interval_m'])}; {depths}"
        energy = shown(test["energy_J"]["value"], "J", 3)
        text = f"K/H {_factor(k['value'], k['low'], k['high'])}, for {energy}; {depths}"
        tests.append((_name(test["file"]), text))
    return Part(
        title=result.title,
        question=f"Which K/H do {len(tests)} measured grooves have, and does it scatter?",
        answer=answer,
        error=_ERROR,
        plots=[_factors(result), _scatter(result), *_traces(result)],
        tables=tables_of(result, ("Tests", tests), []),
        warnings=[*result.warnings, *result.notes],
        **_repetition(result),
    )


def _repetition(result: IdentificationResult) -> dict[str, Any]:
    """Return files, command and remark that repeat a study."""
    raw, files = result.raw, files_of(result)
    if not raw.measured:
        remark = (
            "The results file holds neither the measured profiles nor the tests file and options,"
            " such as --tests, --columns and --draws: put the profiles beside these files, and add"
            " the options of the study. An identification that is repeated stores them."
        )
        names = (_name(test["file"]) for test in result.tests)
        return {"files": files, "command": command_of(result, "identify", *names), "remark": remark}
    profiles = dict.fromkeys(
        test[key] for test in raw.measured for key in ("profile", "lift", "before") if key in test
    )
    tests, remark = f"{Path(raw.scenario_file).stem}-tests.toml", SAME_NUMBERS
    if profiles:
        remark = (
            "The measured profiles are not stored in the results file; these files are needed too,"
            f" beside {tests}: {', '.join(profiles)}. {remark}"
        )
    options = ["--tests", tests, "--negligible", f"{result.summary['negligible']!r}"]
    if raw.draws is not None:
        options += ["--draws", str(raw.draws)]
    if raw.shared:
        options += ["--share", "k=cylinder,roller"]
    return {
        "files": [*files, (tests, tomlkit.dumps({"test": raw.measured}))],
        "command": command_of(result, "identify", *options),
        "remark": remark,
    }


_NEXT = ("median_per_Pa", "low_per_Pa", "high_per_Pa")


def _name(file: str) -> str:
    return file.rpartition("/")[2]


def _depth(name: str, ends: Sequence[float]) -> str:
    """Return the interval of a depth after its name."""
    return f"{name} {in_unit(ends[0], 'um')} to {shown(ends[1], 'um')}"


def _ends(low: float, high: float) -> str:
    return f"{low:.2f} to {high:.2f}"


def _factor(value: float, low: float, high: float) -> str:
    """Return a wear factor with its interval."""
    return f"{with_range(value, low, high, _SCALE)} 1e-12 1/Pa"


def _factors(result: IdentificationResult) -> Plot:
    """Return the densities of K/H of the specimens and of the next one."""
    plot = axes("K/H [1e-12 1/Pa]", "probability density of ln K/H", x_axis_type="log")
    k, next_one = _SCALE * np.exp(result.ln_k), result.summary["next_specimen"]
    step = float(result.ln_k[1] - result.ln_k[0])
    distance = (result.ln_k - np.log(next_one["median_per_Pa"])) / np.log(next_one["factor"])
    named = [*zip(result.raw.specimens, result.test_density, strict=True)]
    named.append(("next specimen", np.exp(-0.5 * distance**2)))
    for number, (name, values) in enumerate(named):
        density = values / (values.sum() * step)
        last = number == len(named) - 1
        data = columns(k=k, density=density)
        style = {"color": "black" if last else COLOURS[number % len(COLOURS)], "width": 2}
        dash = "dashed" if last else "solid"
        line = plot.line(
            "k", "density", source=data, line_dash=dash, legend_label=_name(name), **style
        )
        hover(plot, [line], (_name(name), "K/H @k{0.00}e-12 1/Pa"))
    visible = k[np.max([values / values.max() for _, values in named], axis=0) > 1e-3]
    plot.x_range.update(start=float(visible.min()), end=float(visible.max()))
    legend(plot)
    text = "Density of the wear factor of each specimen, and of the next one."
    return Plot("Wear factors", text, plot)


def _scatter(result: IdentificationResult) -> Plot:
    """Return the density of the scatter of ln K/H."""
    t = result.scatter
    density = (result.posterior * np.gradient(result.values("mean_ln_k"), axis=1)).sum(axis=1)
    density /= np.trapezoid(density, t)
    visible = Range1d(start=0.0, end=max(1.3 * result.scatter_of_k["high"], 0.3))
    plot = axes("scatter t of ln K/H", "probability density", x_range=visible)
    data = columns(t=t, density=density)
    plot.varea("t", 0.0, "density", source=data, color=BLUE, alpha=0.22)
    line = plot.line("t", "density", source=data, color=BLUE, width=2)
    hover(plot, [line], ("t", "@t{0.000}"), ("density", "@density{0.00}"))
    negligible = float(result.summary["negligible"])
    plot.line([negligible] * 2, [0.0, float(density.max())], color=GREY, line_dash="dashed")
    found = result.scatter_of_k
    text = f"95 %: {_ends(found['low'], found['high'])}. Dashed: a negligible scatter."
    return Plot("Scatter of the wear factor itself", text, plot)


def _traces(result: IdentificationResult) -> list[Plot]:
    """Return the measured traces against the profiles of the model."""
    names, plots = ("y", "height", "fitted", "low", "high"), []
    for place, test in enumerate(result.tests[:MOST_TRACES]):
        rows = [result.values(f"trace_{name}")[place] for name in names]
        known = np.flatnonzero(np.isfinite(rows[0]))
        if len(known) == 0:  # only a depth was measured
            continue
        every = known[evenly_spaced(len(known), MOST_POINTS)]
        y, *heights = (row[every] for row in rows)
        each = dict(zip(names[1:], (UM * height for height in heights), strict=True))
        lift = test.get("quantity") == "lift"
        across = ("angle", "deg") if lift else ("y", "mm")
        data = columns(y=y * PER_SI[across[1]], **each)
        plot = axes(
            f"{across[0]} [{across[1]}]", "change of the lift [um]" if lift else "height [um]"
        )
        plot.varea("y", "low", "high", source=data, color=ORANGE, alpha=0.4)
        style = {"size": 3, "color": GREY, "legend_label": "measured"}
        plot.scatter("y", "height", source=data, **style)
        style = {"color": BLUE, "width": 2, "legend_label": "best profile, with 95 % band"}
        line = plot.line("y", "fitted", source=data, **style)
        tips = ("measured", "@height{0.00} um"), ("model", "@fitted{0.00} um")
        hover(plot, [line], (across[0], f"@y{{0.000}} {across[1]}"), *tips)
        legend(plot)
        text = _depth("Model's depth", test["model_depth_interval_m"])
        if test["depth_interval_m"] is not None:
            text = f"{_depth('Measured depth', test['depth_interval_m'])}. {text}"
        what = "Lift" if lift else "Groove"
        plots.append(Plot(f"{what} {_name(test['file'])}", f"{text}.", plot))
    return plots
