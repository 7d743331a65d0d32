"""Identified wear factors and planned tests: tables in engineering units, JSON in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import typer

from wearsim.cli.shared import write_list, write_notes, write_table
from wearsim.report.summary import with_range
from wearsim.report.text import NOTHING, lapse, shown
from wearsim.results import IdentificationResult
from wearsim.studies.identify.planning import SCATTERS, PlannedDesign
from wearsim.uq.hierarchy.verdict import MOST_TESTS

_EXPECTED = 2.0 / 3.0

Rows: TypeAlias = list[tuple[str, str]]


def identification_json(result: IdentificationResult) -> dict[str, Any]:
    """Return tests, scatter and verdict for JSON."""
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


def write_identification(
    result: IdentificationResult, more: Sequence[tuple[str, str]] = ()
) -> None:
    """Write the wear factors of all tests, and what they say together, to stdout.

    Parameters
    ----------
    result : IdentificationResult
    more : sequence of (str, str)
        Last rows.
    """
    typer.echo(result.title)
    heads = (
        "test",
        "levelled on",
        "measured depth [um]",
        "model's depth [um]",
        "area [mm^2]",
        "K/H [1e-12 1/Pa]",
        "residuals",
    )
    write_list(heads, [_line(test) for test in result.tests])
    rows = [
        *_energy(result),
        *_exponents(result),
        *_scatter(result),
    ]
    write_table("", [*rows, *more, ("wall time", lapse(result.raw.wall_seconds))])
    write_notes(result.notes, result.warnings)


def _line(test: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the row of a measured groove."""
    measured, depth = test["depth_interval_m"], test["model_depth_interval_m"]
    area, k = test["area_interval_m2"], test["k_over_h_per_Pa"]
    residuals = NOTHING
    if test["residual_ratio"] is not None:
        tilt = f"tilt {1e3 * test['inclination_rad']:.2g} mrad, "
        ratio = f"{test['residual_ratio']:.2f} (p {test['residual_probability']:.2f})"
        residuals = f"{tilt}{ratio}, r1 {test['residual_autocorrelation']:.2f}"
    return (
        test["file"].rpartition("/")[2],
        test["levelled_on"],
        NOTHING if measured is None else with_range(test["depth_m"], measured[0], measured[1], 1e6),
        with_range(test["model_depth_m"], depth[0], depth[1], 1e6),
        NOTHING if area is None else with_range(test["area_m2"], area[0], area[1], 1e6),
        with_range(k["value"], k["low"], k["high"], 1e12),
        residuals,
    )


def _energy(result: IdentificationResult) -> Rows:
    """Return the energy for which the wear factors hold."""
    energies = [test["energy_J"]["value"] for test in result.tests]
    parts = [test["share_of_inputs"] for test in result.tests]
    inputs = f"{100.0 * min(parts):.0f} to {100.0 * max(parts):.0f} %"
    if round(100.0 * min(parts)) == round(100.0 * max(parts)):
        inputs = f"{100.0 * parts[0]:.0f} %"
    return [
        ("K/H holds for the energy", ", ".join(shown(one, "J", 3) for one in energies)),
        ("variance of ln K/H from inputs", inputs),
    ]


def _exponents(result: IdentificationResult) -> Rows:
    """Return the growth of depth with passes of specimens measured several times."""
    return [
        (
            f"depth of {name}",
            (
                f"~ passes^{found['value']:.3f} ({found['low']:.3f} to {found['high']:.3f});"
                f" {_EXPECTED:.3f} for rigid bodies in full slip under a constant load"
            ),
        )
        for name, found in result.summary["exponents"].items()
    ]


def _scatter(result: IdentificationResult) -> Rows:
    """Return scatter, verdict, sensitivity to the prior and what would decide."""
    summary, tests = result.summary, len(result.raw.specimens)
    t, seen = summary["scatter_of_k"], summary["scatter_seen"]
    factor, middle = summary["bayes_factor"], summary["k_over_h_median_per_Pa"]
    following = summary["next_specimen"]
    ratio = summary["likelihood_ratio"]
    sensitivity = "; ".join(
        f"{row['prior_scale']:g}: {row['bayes_factor']:.2f}, t {row['scatter_of_k']:.2f}"
        for row in summary["sensitivity"]
    )
    rows = [
        ("scatter of ln K/H seen", NOTHING if seen is None else f"{seen:.3f}"),
        ("scatter that inputs explain", f"{summary['scatter_from_inputs']:.3f}"),
        (
            "scatter t of ln K/H itself",
            (
                f"{t['value']:.2f} (90 %: {t['low_90']:.2f} to {t['high_90']:.2f};"
                f" 95 %: {t['low']:.2f} to {t['high']:.2f})"
            ),
        ),
        ("verdict", result.verdict_words),
        ("Bayes factor of t = 0", f"{factor:.2f} against t ~ half-normal(0.5)"),
        ("by the scale of the prior", sensitivity),
    ]
    if ratio is not None:
        limit = summary["likelihood_ratio_95"]
        rows.append(
            ("likelihood ratio of t = 0", f"{ratio:.2f}; 95 % of such tests stay below {limit:.2f}")
        )
    rows += [
        (
            "K/H, median of specimens",
            f"{with_range(middle['value'], middle['low'], middle['high'], 1e12)} 1e-12 1/Pa",
        ),
        (
            "K/H, next specimen",
            with_range(
                following["median_per_Pa"], following["low_per_Pa"], following["high_per_Pa"], 1e12
            )
            + " 1e-12 1/Pa",
        ),
        (
            "what would decide" if summary["to_decide"]["needed"] else "power of the tests",
            deciding(summary["to_decide"], tests),
        ),
    ]
    return rows


def deciding(found: Mapping[str, Any], tests: int) -> str:
    """Return what would decide, in words.

    Parameters
    ----------
    found : mapping of str to object
        "to_decide" of the JSON output.
    tests : int
        Number of tests at hand.
    """
    measure = ", ".join(found["measure"]) or "all inputs"
    many = found["tests"]
    now = f"{found['power']:.2f} by these {tests} tests" if tests > 1 else "0 by one test"
    lines = [
        f"a scatter of {found['scatter']:g} is seen with probability {now}, and 0.8 by "
        + (f"{many}" if many else f"more than {found['most_tests']}")
        + " such tests"
    ]
    if found["tests_if_measured"] and found["power_if_measured"] > found["power"]:
        lines.append(
            f"with {measure} measured, so that inputs leave 0.1: {found['power_if_measured']:.2f},"
            f" and 0.8 by {found['tests_if_measured']} tests"
        )
    return "\n".join(lines)


def plan_json(designs: Sequence[PlannedDesign]) -> dict[str, Any]:
    """Return the power of planned tests for JSON."""
    return {
        "designs": [
            {
                "inputs": design.name,
                "scatter_from_inputs": design.scatter_from_inputs,
                "tests": design.tests,
                "false_random": design.random[0.0],
                "explained": design.explained[0.0],
                "power": {f"{t:g}": design.random[t] for t in SCATTERS},
                "tests_for_power_0.8": {f"{t:g}": design.needed[t] for t in SCATTERS},
            }
            for design in designs
        ]
    }


def write_plan(title: str, designs: Sequence[PlannedDesign]) -> None:
    """Write the power of planned tests to stdout."""
    typer.echo(title)
    for design in designs:
        typer.echo(
            f"\ninputs {design.name}: they scatter ln K/H by {design.scatter_from_inputs:.3f}"
        )
        powers = [f"power, t = {t:g}" for t in SCATTERS]
        heads = ("tests", *powers, "false 'random'", "'explained' if t = 0")
        rows = zip(
            design.tests,
            *(design.random[t] for t in (*SCATTERS, 0.0)),
            design.explained[0.0],
            strict=True,
        )
        write_list(heads, [(str(row[0]), *(f"{rate:.2f}" for rate in row[1:])) for row in rows])
        for t in SCATTERS:
            tests = design.needed[t]
            reached = f"{tests} tests" if tests else f"more than {MOST_TESTS} tests"
            typer.echo(f"a scatter of {t:g} is found with power 0.8 by {reached}")
