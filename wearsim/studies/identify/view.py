"""View of an identification: verdict, scatter and wear factors, traces, and repetition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from wearsim.report.text import NOTHING, lapse, shown, with_range
from wearsim.report.view import Column, Columns, Frame, Repetition, Row, Rows, Table
from wearsim.results.study_view import StudyView
from wearsim.studies.identify.result import IdentificationResult

_SCALE = 1e12  # K/H is shown in 1e-12 1/Pa
_EXPECTED = 2.0 / 3.0
_ERROR = (
    "Intervals hold 95 %. In full slip a groove shows the product of K/H and dissipated energy: a"
    " K/H holds for the stated energy. The error of the contact model is not contained."
)
_HEADS = (
    "test",
    "levelled on",
    "measured depth [um]",
    "model's depth [um]",
    "area [mm^2]",
    "K/H [1e-12 1/Pa]",
    "residuals",
)

_NEXT = ("median_per_Pa", "low_per_Pa", "high_per_Pa")


class IdentificationView(StudyView[IdentificationResult]):
    """Verdict on the scatter of K/H, scatter seen and explained, K/H of the next specimen.

    Panels: wear factors, scatter, its density with the median, traces with their residuals. Files:
    tests and traces; the table of pandas has the tests.
    """

    verb, sheet = "identify", "wearsim.studies.identify.panels:identification_sheet"
    basis = _ERROR

    def __init__(self, result: IdentificationResult) -> None:
        super().__init__(result)
        self.question = f"Which K/H do {len(result.tests)} measured grooves have, is K/H random?"

    def rows(self) -> Rows:
        """Return the verdict, scatter, sensitivity to the prior and what would decide."""
        result, summary = self.result, self.result.summary
        t, seen = summary["scatter_of_k"], summary["scatter_seen"]
        following, ratio = summary["next_specimen"], summary["likelihood_ratio"]
        middle = summary["k_over_h_median_per_Pa"]
        sensitivity = "; ".join(
            f"{row['prior_scale']:g}: {row['bayes_factor']:.2f}, t {row['scatter_of_k']:.2f}"
            for row in summary["sensitivity"]
        )
        scatter = (
            f"{t['value']:.2f} (90 %: {t['low_90']:.2f} to {t['high_90']:.2f};"
            f" 95 %: {t['low']:.2f} to {t['high']:.2f})"
        )
        factor = f"{summary['bayes_factor']:.2f} against t ~ half-normal(0.5)"
        rows = [
            Row("verdict", result.verdict_words),
            Row("scatter of ln K/H seen", NOTHING if seen is None else f"{seen:.3f}"),
            Row("scatter that inputs explain", f"{summary['scatter_from_inputs']:.3f}"),
            Row("scatter t of ln K/H itself", scatter),
            Row("Bayes factor of t = 0", factor),
            Row("by the scale of the prior", sensitivity),
        ]
        if ratio is not None:
            limit = f"95 % of such tests stay below {summary['likelihood_ratio_95']:.2f}"
            rows.append(Row("likelihood ratio of t = 0", f"{ratio:.2f}; {limit}"))
        decide = summary["to_decide"]
        return [
            *rows,
            Row("K/H, median of specimens", _wear_factor(middle, ("value", "low", "high"))),
            Row("K/H, next specimen", _wear_factor(following, _NEXT)),
            Row(
                "what would decide" if decide["needed"] else "power of the tests",
                deciding(decide, len(result.raw.specimens)),
            ),
        ]

    def study(self) -> Rows:
        """Return energies, variance from inputs, growth with passes, and effort."""
        result = self.result
        energies = [test["energy_J"]["value"] for test in result.tests]
        parts = [round(100.0 * test["share_of_inputs"]) for test in result.tests]
        low, high = min(parts), max(parts)
        inputs = f"{high} %" if low == high else f"{low} to {high} %"
        return [
            Row(
                "K/H holds for the energy", ", ".join(shown(energy, "J", 3) for energy in energies)
            ),
            Row("variance of ln K/H from inputs", inputs),
            *(
                Row(
                    f"depth of {name}",
                    f"~ passes^{exponent['value']:.3f} ({exponent['low']:.3f} to"
                    f" {exponent['high']:.3f}); {_EXPECTED:.3f} for rigid bodies in full slip"
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
        tests, names = self.result.tests, ("height", "fitted", "low", "high")
        texts = {
            "depth [um]": [_number(test["depth_m"], 1e6) for test in tests],
            "model_depth [um]": [_number(test["model_depth_m"], 1e6) for test in tests],
        }
        for end, name in (("value", "K/H [1/Pa]"), ("low", "low [1/Pa]"), ("high", "high [1/Pa]")):
            texts[name] = [_number(test["k_over_h_per_Pa"][end]) for test in tests]
        first = {name: [test[name] for test in tests] for name in ("file", "specimen")}
        first["passes"] = [_number(test["passes"]) for test in tests]
        traces = [self.result.values(f"trace_{name}") for name in ("y", *names)]
        known = np.isfinite(traces[0])
        numbers = np.broadcast_to(np.arange(1.0, len(known) + 1.0)[:, None], known.shape)
        y, *heights = (trace[known] for trace in traces)
        curves = [
            Column(name, height, "um", 1e-6) for name, height in zip(names, heights, strict=True)
        ]
        return {
            "tests.csv": [[Column(name, cells) for name, cells in {**first, **texts}.items()]],
            "traces.csv": [[Column("test", numbers[known]), Column("y", y, "mm", 1e-3), *curves]],
        }

    def frame(self) -> Frame:
        """Return the tests, one row for each groove."""
        tests = self.result.tests

        def column(name: str, unit: str, key: str = "") -> tuple[str, str, Any]:
            values = [test[name][key] if key else test[name] for test in tests]
            title = f"{name}_{key}" if key not in {"", "value"} else name
            return title, unit, np.array([np.nan if value is None else value for value in values])

        return Frame(
            [
                column("file", ""),
                column("specimen", ""),
                column("passes", "1"),
                column("depth_m", "m"),
                column("model_depth_m", "m"),
                *(column("k_over_h_per_Pa", "1/Pa", end) for end in ("value", "low", "high")),
                column("energy_J", "J", "value"),
            ],
            "groove",
            range(1, len(tests) + 1),
        )

    def repetition(self) -> Repetition:
        """Return files, command and remark that repeat the study."""
        raw, (command, files, remark) = self.result.raw, super().repetition()
        if raw.measured:
            files = {**files, self._tests_file: tomlkit.dumps({"test": raw.measured})}
        profiles = dict.fromkeys(
            test[key]
            for test in raw.measured
            for key in ("profile", "lift", "before")
            if key in test
        )
        if not raw.measured:
            remark = (
                "The results file holds neither the measured profiles nor the tests file and"
                " options, such as --tests, --columns and --draws: put the profiles beside these"
                " files, and add the options of the study. An identification that is repeated"
                " stores them."
            )
        elif profiles:
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
        negligible = f"{self.result.summary['negligible']!r}"
        options = ["--tests", self._tests_file, "--negligible", negligible]
        options += ["--draws", str(raw.draws)] if raw.draws is not None else []
        return [*options, *(["--share", "k=cylinder,roller"] if raw.shared else [])]


def _name(file: str) -> str:
    return file.rpartition("/")[2]


def _number(value: float | None, scale: float = 1.0) -> str:
    return "" if value is None else f"{scale * value:.12g}"


def _wear_factor(factor: Mapping[str, float], names: Sequence[str]) -> str:
    """Return a wear factor with its interval."""
    value, *ends = (factor[name] for name in names)
    return f"{with_range(value, ends, _SCALE)} 1e-12 1/Pa"


def _cells(test: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the cells of a measured groove."""
    measured, depth = test["depth_interval_m"], test["model_depth_interval_m"]
    area, k = test["area_interval_m2"], test["k_over_h_per_Pa"]
    residuals = NOTHING
    if test["residual_ratio"] is not None:
        tilt = f"tilt {1e3 * test['inclination_rad']:.2g} mrad, "
        ratio = f"{test['residual_ratio']:.2f} (p {test['residual_probability']:.2f})"
        residuals = f"{tilt}{ratio}, r1 {test['residual_autocorrelation']:.2f}"
    return (
        _name(test["file"]),
        test["levelled_on"],
        NOTHING if measured is None else with_range(test["depth_m"], measured, 1e6),
        with_range(test["model_depth_m"], depth, 1e6),
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
    measure = ", ".join(decision["measure"]) or "all inputs"
    many = decision["tests"]
    now = f"{decision['power']:.2f} by these {tests} tests" if tests > 1 else "0 by one test"
    lines = [
        f"a scatter of {decision['scatter']:g} is seen with probability {now}, and 0.8 by "
        + (f"{many}" if many else f"more than {decision['most_tests']}")
        + " such tests"
    ]
    if decision["tests_if_measured"] and decision["power_if_measured"] > decision["power"]:
        lines.append(
            f"with {measure} measured, so that inputs leave 0.1:"
            f" {decision['power_if_measured']:.2f}, and 0.8 by"
            f" {decision['tests_if_measured']} tests"
        )
    return "\n".join(lines)
