"""One self-contained page on results, for a browser."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from wearsim.errors import PluginError, WearsimError
from wearsim.report import summary
from wearsim.report.parts import Measured, computed_profile, residual_text, save_text
from wearsim.report.text import (
    against,
    count,
    in_unit,
    kind,
    number_of_realisations,
    shown,
    with_interval,
)
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.identification import IdentificationResult
from wearsim.studies.ensemble.compare import compare

if TYPE_CHECKING:
    from wearsim.report.page.plots import Plot

Reported: TypeAlias = Result | EnsembleResult | DissipationResult | IdentificationResult
NO_STEPPING_ERROR = "Every roller pass is solved: there is no stepping error."
NOT_MODEL = (
    "The stated error is that of the steps in time. It does not contain the errors of the contact"
    " model, of the wear law or of the inputs."
)
SAMPLING = (
    "Intervals in brackets hold the true value with 95 % confidence for the stated scatter of the"
    " inputs. They do not contain the errors of the contact model or of the wear law."
)


@dataclass(frozen=True)
class Part:
    """Part of a page: a question, its answer, figures and tables.

    Parameters
    ----------
    title : str
    question : str
        What was asked, in a sentence.
    answer : list of (str, str)
        Name and value; the first one is the answer, the others complete it.
    error : str
        What the stated errors contain.
    plots : list of Plot
    tables : list of (str, list of (str, str))
        Title and rows.
    warnings : list of str
    steps : list of str
        Text of each position of the slider, if the figures have records.
    files : list of (str, str)
        Name and text of the scenario and the input files.
    command : str
        Command that repeats the computation.
    """

    title: str
    question: str
    answer: summary.Rows
    error: str
    plots: list[Plot]
    tables: list[tuple[str, summary.Rows]]
    warnings: list[str] = field(default_factory=list)
    steps: list[str] = field(default_factory=list)
    files: list[tuple[str, str]] = field(default_factory=list)
    command: str = ""


def save_report(results: Sequence[Reported], path: Path, measured: Sequence[Measured] = ()) -> None:
    """Write a page on results; it loads nothing from a network.

    Parameters
    ----------
    results : sequence of Result, EnsembleResult, DissipationResult or IdentificationResult
        Several runs and ensembles are also compared.
    path : Path
        An existing file is replaced.
    measured : sequence of Measured
        Profiles drawn over those of runs and ensembles.

    Raises
    ------
    PluginError
        If bokeh or jinja2 is not installed, which are part of the extra ``wearsim[report]``.
    ResultsFileError
        If the page cannot be written.
    """
    save_text(page_of(results, measured), path)


def page_of(results: Sequence[Reported], measured: Sequence[Measured] = ()) -> str:
    """Return the page as HTML; parameters and errors as of `save_report`."""
    try:
        from bokeh.embed import components  # noqa: PLC0415  (optional)
        from bokeh.resources import Resources  # noqa: PLC0415
        from jinja2 import Environment, PackageLoader  # noqa: PLC0415
    except ImportError as error:
        raise PluginError(
            f"a page needs packages that are not installed ({error}); install them with:"
            " pip install 'wearsim[report]'"
        ) from error
    parts = [_part(result, measured) for result in results]
    if len(results) > 1:
        parts.insert(0, _comparison(results))
    plots = [plot for part in parts for plot in part.plots]
    drawn = [plot.figure for plot in plots]
    script, divisions = components(drawn) if drawn else ("", ())
    figures = iter(divisions)
    shown_parts = [(part, [(plot, next(figures)) for plot in part.plots]) for part in parts]
    template = Environment(
        loader=PackageLoader("wearsim.report.page", "."), autoescape=True, trim_blocks=True
    ).get_template("page.html.jinja")
    resources = Resources(mode="inline", components=["bokeh"], log_level="fatal")
    return template.render(
        title=parts[0].title,
        parts=shown_parts,
        script=script,
        resources=resources.render(),
    )


def _part(result: Reported, measured: Sequence[Measured]) -> Part:
    if isinstance(result, LifeResult):
        from wearsim.report.page.life_part import of_life  # noqa: PLC0415  (imports bokeh)

        return of_life(result)
    if isinstance(result, IdentificationResult):
        from wearsim.report.page.identification_part import of_identification  # noqa: PLC0415

        return of_identification(result)
    if isinstance(result, EnsembleResult):
        return _of_ensemble(result, measured)
    if isinstance(result, DissipationResult):
        return _of_dissipation(result)
    return _of_run(result, measured)


def _of_run(result: Result, measured: Sequence[Measured]) -> Part:
    from wearsim.report.page.run_plots import records_of, run_plots  # noqa: PLC0415  (bokeh)

    raw, answer = result.raw, summary.end_state(result)
    value, error = shown(float(np.max(result.depth[-1])), "um"), NO_STEPPING_ERROR
    if result.stepper != "per-pass":
        value += f" ± {shown(float(np.max(result.depth_error[-1])), 'um', 2)}"
        error = NOT_MODEL
    answer[0] = (answer[0][0], value)
    body, length = "cylinder", f"{count(raw.total_passes)} roller passes"
    if "station_angle" in raw.static:
        turns = raw.total_passes / raw.kinematics["physical_rollers"]
        body, length = "cam", f"{count(turns)} turns"
    time = shown(raw.total_passes / raw.kinematics["pass_rate"], "min")
    test = [
        ("reached", summary.standing(result)),
        ("contact model", result.described_model),
        ("stepper", f"{result.stepper}, tolerance {raw.tolerance:g}"),
        ("strips", str(len(result.y))),
        *summary.effort(result),
    ]
    return Part(
        title=result.title,
        question=f"How deep does the {body} wear in {length} ({time})?",
        answer=answer,
        error=error,
        plots=run_plots(result, measured),
        tables=tables_of(result, ("Test", test), summary.draws(result), measured),
        warnings=[*filter(None, [result.failure]), *result.warnings, *result.notes],
        steps=[_position(result, record) for record in records_of(result)],
        files=files_of(result),
        command=command_of(result, "run"),
    )


def _position(result: Result, record: int) -> str:
    passes, time = float(result.record_passes[record]), float(result.record_time[record])
    return f"pass {count(passes)}, {shown(time, 'min')}"


def _of_ensemble(result: EnsembleResult, measured: Sequence[Measured]) -> Part:
    from wearsim.report.page.study_plots import ensemble_plots  # noqa: PLC0415  (bokeh)

    raw, time = result.raw, shown(result.raw.total_time, "min")
    done = f"{count(result.count)} of {count(result.requested)}, {count(result.failed)} failed"
    tests = [
        ("done", done),
        ("sampling design", f"{raw.plan}, seed {raw.seed}"),
        ("length of a test", f"{count(raw.total_passes)} passes, {time}"),
        ("contact model", result.described_model),
        ("stepper", f"{raw.stepper}, tolerance {raw.tolerance:g}"),
    ]
    failures = [f"test {number} failed: {text}" for number, text in list(result.errors.items())[:3]]
    options = ("-n", str(result.requested), "--plan", raw.plan, "--seed", str(raw.seed))
    return Part(
        title=result.title,
        question=f"How deep do {number_of_realisations(result.count)} of a test of"
        f" {count(raw.total_passes)} roller passes ({time}) wear the cylinder?",
        answer=summary.estimates(result),
        error=SAMPLING,
        plots=ensemble_plots(result, measured),
        tables=tables_of(result, ("Tests", tests), summary.input_rows(result), measured),
        warnings=[*failures, *result.warnings, *result.notes],
        files=files_of(result),
        command=command_of(result, "ensemble", *options),
    )


def _of_dissipation(result: DissipationResult) -> Part:
    from wearsim.report.page.study_plots import dissipation_plots  # noqa: PLC0415  (bokeh)

    raw, power = result.raw, result.summaries["power"]
    spread = shown(summary.NINETY_FIVE * power.mean_error, "W", 2)
    answer = [("mean dissipated power", f"{shown(power.mean, 'W')} ± {spread}")]
    if power.count > 1 and not power.is_constant:
        ends = " to ".join(in_unit(power.quantile(p).value, "W") for p in (0.025, 0.975))
        answer.append(("95 % of the realisations", f"{ends} W"))
        answer.append(("standard deviation", shown(power.std, "W")))
    study = [
        ("realisations", count(result.count)),
        ("sampling design", f"{raw.plan}, seed {raw.seed}"),
        ("contact model", result.described_model),
    ]
    options = ("-n", str(raw.requested), "--plan", raw.plan, "--seed", str(raw.seed))
    return Part(
        title=result.title,
        question="How much power does one contact dissipate, in"
        f" {number_of_realisations(result.count)}?",
        answer=answer,
        error=SAMPLING,
        plots=dissipation_plots(result),
        tables=tables_of(result, ("Study", study), summary.input_rows(result)),
        warnings=[*result.warnings, *result.notes],
        files=files_of(result),
        command=command_of(result, "dissipation", *options),
    )


def _comparison(results: Sequence[Reported]) -> Part:
    """Return the comparison of runs and ensembles by their depths."""
    from wearsim.report.page.study_plots import comparison_plots  # noqa: PLC0415  (bokeh)

    labels = [one.path.stem if one.path else one.title for one in results]
    if len(set(labels)) < len(labels):
        labels = [f"{number}: {label}" for number, label in enumerate(labels, 1)]
    lives = [one for one in results if isinstance(one, LifeResult)]
    if len(lives) == len(results):
        from wearsim.report.page.life_part import of_lives  # noqa: PLC0415  (imports bokeh)

        return of_lives(lives, labels)
    tests = [one for one in results if isinstance(one, Result | EnsembleResult) and not lives]
    if len(tests) < len(results):
        raise WearsimError(
            "a page compares runs and ensembles, or lives, with each other only; write one page for"
            " each of the others"
        )
    found = compare(tests, labels)
    each = [(row.label, f"{with_interval(row.value, 'um')}, {kind(row)}") for row in found.rows]
    return Part(
        title=f"{', '.join(labels[:-1])} and {labels[-1]}",
        question="How do the depths at the end of these tests differ?",
        answer=[*(item for row in found.rows[1:] for item in against(found, row)), *each],
        error="Intervals of ensembles are those of their means; those of runs contain the error of"
        " the steps only.",
        plots=comparison_plots(found, dict(zip(labels, tests, strict=True))),
        tables=[],
    )


def tables_of(
    result: Reported,
    first: tuple[str, summary.Rows],
    inputs: summary.Rows,
    measured: Sequence[Measured] = (),
) -> list[tuple[str, summary.Rows]]:
    """Return the tables of a part: the study, its inputs, measured profiles, and its origin."""
    residuals = []
    if measured and isinstance(result, Result | EnsembleResult):
        computed = computed_profile(result)
        residuals = [(one.label, residual_text(one, computed)) for one in measured]
    origin = summary.sources(result.raw)
    return [first, ("Random inputs", inputs), ("Measured profiles", residuals), ("Origin", origin)]


def files_of(result: Reported) -> list[tuple[str, str]]:
    """Return names and texts of the scenario and of its input files."""
    raw = result.raw
    files = {raw.scenario_file: raw.scenario_text, **raw.files}
    return [(Path(name).name, text) for name, text in files.items()]


def command_of(result: Reported, verb: str, *options: str) -> str:
    """Return the command that repeats a computation from the files of the page."""
    return shlex.join(["wearsim", verb, Path(result.raw.scenario_file).name, *options])
