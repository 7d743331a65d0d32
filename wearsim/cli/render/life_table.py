"""Lives of designs: tables with lives in passes or turns, and JSON."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import typer

from wearsim.cli.shared import write_list, write_table
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.report.lives import (
    effect_cells,
    life_cells,
    rare_command,
    rare_text,
    rounded_lives,
    target_text,
)
from wearsim.report.summary import Rows, input_rows, limits_of
from wearsim.report.text import NOTHING, count, lapse, part_with_interval, shown, too_few
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable, LifeComparison
from wearsim.scenario import Scenario
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.lives import least_survival


@contextmanager
def going_on(
    labels: Sequence[str],
    scenarios: Sequence[Scenario],
    paths: Sequence[Path],
    key: str,
    path: Path,
) -> Iterator[None]:
    """Add the commands for the other designs to the error of a file that exists or was stopped.

    Parameters
    ----------
    labels, scenarios, paths : sequence
        Designs and their results files.
    key : str
        Key of a sweep, whose values are the labels; empty for scenarios.
    path : Path
        The file in question.

    Raises
    ------
    ResultsFileError, Interrupted
        Those within, with more text where several designs are compared.
    """
    try:
        yield
    except (ResultsFileError, Interrupted) as error:
        if len(paths) == 1 or not path.exists():
            raise
        each = zip(labels, scenarios, paths, strict=True)
        commands = []
        for label, scenario, file in (item for item in each if not item[2].exists()):
            swept = ["--set", f"{key}={label}"] if key else []
            options = [*swept, "--seed", str(scenario.seed), "-o", str(file)]
            commands.append(shlex.join(["wearsim", "life", scenario.file, *options]))
        steps = [f"`{command}` with the other options" for command in commands]
        steps.append(f"`{shlex.join(['wearsim', 'life', *map(str, paths)])}`")
        text = f"{error.at_shell}; the comparison is finished by {', then '.join(steps)}"
        raise type(error)(text) from error


def write_life(result: LifeResult, more: Rows) -> None:
    """Write the life of a design to stdout.

    Parameters
    ----------
    result : LifeResult
    more : list of (str, str)
        Last rows.
    """
    settings, unit = result.settings, result.unit
    done = f"{count(result.count)} done, {count(result.failed)} failed"
    if result.requested > 1:
        done += f", of {count(settings.plain)}"
    rows = [
        ("life", f"{unit} until the first of: {', '.join(limits_of(result.scenario.limit.given))}"),
        ("realisations", done if result.finished else f"{done}, unfinished"),
        ("wear factor", _wear_factor(result)),
        ("lives", _ends(result)),
    ]
    write_table(result.title, rows)
    if result.count:
        _write_lives(result)
        _write_fits(result)
        _write_limits(result)
        _write_effects(result)
    rows = [("95 % intervals", result.method)] if result.count else []
    seconds = result.raw.wall_seconds
    write_table("", [*rows, *input_rows(result), ("wall time", lapse(seconds)), *more])


def _wear_factor(result: LifeResult) -> str:
    settings = result.settings
    if not settings.factor:
        return f"lives are counted: {settings.reason}"
    alone = "; nothing else is random, so that one test is sufficient" if settings.alone else ""
    return f"{settings.factor} is integrated exactly{alone}"


def _ends(result: LifeResult) -> str:
    """Return how many lives ended, were censored and were zero."""
    text = f"{count(int(result.observed.sum()))} ended by a limit"
    text += f", {count(result.censored)} censored at {count(result.most)} {result.unit}"
    if result.at_once:
        text += f"; {count(result.at_once)} reached a limit at once, when fresh"
    return text


def _write_lives(result: LifeResult) -> None:
    heads = [f"life [{result.unit}]", "estimate", "95 % interval", "numerical error"]
    lines = []
    for share in result.settings.shares:
        ends = result.b_error(share)
        low, high = rounded_lives(*ends)
        error = f"{low}..{high}" if all(map(math.isfinite, ends)) else NOTHING
        lines.append([f"B{share:g}", *life_cells(result, share), error])
    write_list(heads, lines)
    if not result.observed.any() and not result.is_exact and result.count:
        bound = least_survival(result.count)
        typer.echo(
            f"no life ended: at least {shown(bound, '%', 3)} survive {count(result.most)}"
            f" {result.unit}, with 95 % confidence"
        )
    target = result.target
    if target is not None:
        obstacle = result.probability_obstacle(target)
        equals = "is" if obstacle else "="
        typer.echo(f"P(life < {count(target)} {result.unit}) {equals} {target_text(result)}")
        if obstacle and result.rare is None and not result.settings.alone:
            typer.echo(f"further tests that sample the other inputs: `{rare_command(result)}`")
    for method, estimate in result.rare_estimates.items():
        typer.echo(f"by {method}: {rare_text(estimate)}")
    if result.rare is not None and not result.rare.is_reliable:
        typer.echo("no probability is stated; give a greater --rare")


def _write_fits(result: LifeResult) -> None:
    if len(result.fits) < 2:
        return
    typer.echo("")
    shares = result.settings.shares
    heads = [f"fit [{result.unit}]", *(f"B{share:g}" for share in shares), "AIC", "parameters"]
    lines = []
    for fit in result.fits:
        cells = [_fitted(fit.interval(share / 100.0)) for share in shares]
        scale = f"{count(math.exp(fit.mu))} {result.unit}"
        parameters = (
            f"median {scale}, sigma {fit.sigma:.3f}"
            if fit.family == "log-normal"
            else f"scale {scale}, shape {1.0 / fit.sigma:.3f}"
        )
        lines.append([fit.family, *cells, f"{fit.aic - result.fits[0].aic:+.1f}", parameters])
    write_list(heads, lines)


def _fitted(found: Interval) -> str:
    return "{1} ({0}..{2})".format(*rounded_lives(found.low, found.value, found.high))


def _write_limits(result: LifeResult) -> None:
    typer.echo("")
    lines, angles = [], result.angles
    for name, share in result.first_limits.items():
        where = ""
        if name in angles:
            low, middle, high = np.degrees(np.quantile(angles[name], (0.05, 0.5, 0.95)))
            where = f"at {middle:.1f} deg"
            where += f" (90 % in {low:.1f} to {high:.1f} deg)" if high - low > 0.05 else ""
        lines.append([name.replace("_", " "), shown(share, "%", 3), where])
    write_list(["first limit", "share", ""], lines)


def _write_effects(result: LifeResult) -> None:
    typer.echo("")
    head = "what moves the life: Sobol indices of its logarithm"
    if result.settings.alone or result.count == 1:
        only = result.settings.factor if result.settings.alone else "too few realisations"
        write_list([f"{head}: {only}"], [])
        return
    if result.are_equal:
        write_list([f"{head}: nothing, no two lives differ"], [])
        return
    if result.effects_obstacle:
        write_list([f"{head}: not stated"], [])
        typer.echo(result.effects_obstacle)
        return
    effects = result.sensitivity("life")
    if not any(math.isfinite(item.first.value) for item in effects):
        write_list([f"{head}: {too_few(result)}"], [])
        return
    changes = result.tornado()
    lines = [
        [
            item.name,
            f"not significant, at most {shown(item.first.high, '%', 2)}"
            if item.without_effect
            else part_with_interval(item.first),
            *(effect_cells(changes[item.name]) if item.name in changes else (NOTHING, NOTHING)),
        ]
        for item in effects
    ]
    write_list([head, "first order", "life, input at 10 %", "input at 90 %"], lines)


def write_lives_of(labels: Sequence[str], results: Sequence[LifeResult]) -> None:
    """Write the lives of several designs below each other, with their intervals."""
    shares = results[0].settings.shares
    lines = []
    for label, result in zip(labels, results, strict=True):
        cells = []
        for share in shares:
            value, interval = life_cells(result, share)
            cells.append(f"{value} ({interval})" if interval else value)
        lines.append([label, *cells])
    typer.echo("")
    write_list([f"lives [{results[0].unit}]", *(f"B{share:g}" for share in shares)], lines)


def write_comparison(labels: Sequence[str], found: LifeComparison) -> None:
    """Write the comparison of two designs in words.

    Parameters
    ----------
    labels : sequence of str
        Labels of both.
    found : LifeComparison
    """
    first, second = labels
    ratio = found.b10_ratio
    rows = [("B10 ratio", f"{first} has {_factor(ratio)} times the B10 of {second}")]
    if found.same_machine is not None:
        rows.append(
            (
                "same machine",
                (
                    f"{first} outlives {second} on {part_with_interval(found.same_machine)} of the"
                    " machines, each with the same drawn values for both designs"
                ),
            )
        )
    else:
        rows.append(("same machine", "unknown: the studies have no common draws"))
    rows.append(
        (
            "two specimens",
            (
                f"a specimen of {first} outlives a specimen of {second}, drawn separately, with"
                f" probability {part_with_interval(found.two_specimens)}"
            ),
        )
    )
    write_table("comparison", rows)


def _factor(found: Interval) -> str:
    if not math.isfinite(found.value):
        return "an unknown number of"
    if not math.isfinite(found.half_width):
        return f"{found.value:.3f} [unbounded]"
    if found.half_width == 0.0:
        return f"{found.value:.3f}"
    return f"{found.value:.3f} [{found.low:.3f}, {found.high:.3f}]"


def life_json(result: LifeResult) -> dict[str, Any]:
    """Return the life of a design, lives in its unit."""
    settings, target = result.settings, result.target
    probability = None
    if target is not None:
        obstacle = result.probability_obstacle(target)
        probability = {
            "target": target,
            **asdict(result.probability_before(target)),
            "not_stated_because": obstacle or None,
            "command": rare_command(result) if obstacle and not settings.rare else None,
        }
    lives = {}
    for share in settings.shares:
        low, high = result.b_error(share)
        lives[f"{share:g}"] = {
            **asdict(result.b(share)),
            "lower_bound": result.lower_bound(share) if not result.is_exact else None,
            "numerical_low": low,
            "numerical_high": high,
        }
    return {
        "title": result.title,
        "unit": result.unit,
        "limits": result.scenario.limit.given,
        "realisations": result.count,
        "failed": result.failed,
        "errors": dict(result.errors),
        "censored": result.censored,
        "reached_at_once": result.at_once,
        "maximum": result.most,
        "variable": settings.variable or None,
        "finished": result.finished,
        "b": lives,
        "probability_before_target": probability,
        "rare": _rare_json(result),
        "first_limits": result.first_limits,
        "angles_deg": {name: np.degrees(found) for name, found in result.angles.items()},
        "fits": [
            {
                "family": fit.family,
                "aic": fit.aic,
                "mu": fit.mu,
                "sigma": fit.sigma,
                "b": {f"{p:g}": asdict(fit.interval(p / 100.0)) for p in settings.shares},
            }
            for fit in result.fits
        ],
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
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }


def _rare_json(result: LifeResult) -> dict[str, Any] | None:
    found = result.rare
    if found is None:
        return None
    tried = {}
    for method, item in result.rare_estimates.items():
        known = asdict(item.probability) if item.is_reliable else None
        tried[method] = {**asdict(item), "probability": known, "refused": not item.is_reliable}
    method = next(reversed(tried))
    return {**tried[method], "method": method, "tried": tried}


def comparison_json(found: LifeComparison) -> dict[str, Any]:
    """Return the comparison of two designs."""
    return {
        "b10_ratio": asdict(found.b10_ratio),
        "same_machine": asdict(found.same_machine) if found.same_machine else None,
        "two_specimens": asdict(found.two_specimens),
        "pairs": found.count,
    }


def against_json(variable: DesignVariable, results: Sequence[LifeResult]) -> dict[str, Any]:
    """Return the lives of designs against the design variable, both in the given order."""
    return {
        "key": variable.key,
        "unit": variable.unit,
        "values": [one.variable.value for one in results if one.variable],
        "b": {
            f"{share:g}": [asdict(one.b(share)) for one in results]
            for share in results[0].settings.shares
        },
    }
