"""One self-contained page on results, for a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wearsim.errors import PluginError, WearsimError
from wearsim.report import summary
from wearsim.report.limits import limit_rows
from wearsim.report.measured import Measured
from wearsim.report.page.part import (
    NO_STEPPING_ERROR,
    NOT_MODEL,
    SAMPLING,
    Part,
    Reported,
    command_of,
    files_of,
    tables_of,
)
from wearsim.report.parts import save_text
from wearsim.report.text import (
    against,
    count,
    in_unit,
    kind,
    number_of_realisations,
    shown,
    simulated,
    with_interval,
)
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.identification import IdentificationResult
from wearsim.studies.ensemble.compare import compare


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
    answer[1:1] = limit_rows(result)
    body, length = "cylinder", f"{count(raw.total_passes)} roller passes"
    if "station_angle" in raw.static:
        turns = raw.total_passes / raw.kinematics["physical_rollers"]
        body, length = "cam", f"{count(turns)} turns"
    time = simulated(raw.total_passes / raw.kinematics["pass_rate"])
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
        command=command_of(result, "run", *(("--until", raw.until) if raw.until else ())),
    )


def _position(result: Result, record: int) -> str:
    passes, time = float(result.record_passes[record]), float(result.record_time[record])
    return f"pass {count(passes)}, {simulated(time)}"


def _of_ensemble(result: EnsembleResult, measured: Sequence[Measured]) -> Part:
    from wearsim.report.page.study_plots import ensemble_plots  # noqa: PLC0415  (bokeh)

    raw, time = result.raw, simulated(result.raw.total_time)
    done = f"{count(result.count)} of {count(result.requested)}, {count(result.failed)} failed"
    tests = [
        ("done", done),
        ("sampling design", f"{raw.plan}, seed {raw.seed}"),
        ("length of a test", f"{count(raw.total_passes)} passes, {time}"),
        ("contact model", result.described_model),
        ("stepper", f"{raw.stepper}, tolerance {raw.tolerance:g}"),
    ]
    failures = [f"test {number} failed: {text}" for number, text in list(result.errors.items())[:3]]
    options = ["-n", str(result.requested), "--plan", raw.plan, "--seed", str(raw.seed)]
    options += ["--precision", raw.until] if raw.until else []
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
    spread = shown(power.mean_interval.half_width, "W", 2)
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
