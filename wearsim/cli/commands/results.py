"""Verbs for results files: show, plot, compare and export."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from wearsim.cli.shared import (
    At,
    Columns,
    Figure,
    Force,
    Json,
    MeanRows,
    ResultsFile,
    Row,
    Units,
    check_figure,
    checking,
    note,
    profile_choice,
    write_json,
    write_notes,
    write_table,
)

if TYPE_CHECKING:
    from wearsim.profiles import ProfileChoice
    from wearsim.report.measured import Measured
    from wearsim.results import (
        DissipationResult,
        EnsembleResult,
        IdentificationResult,
        Result,
    )
    from wearsim.results.content import StudyData


_MISALIGNED = 0.5  # ratio of residuals below which levelling is suggested

MeasuredFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--measured",
        metavar="FILE",
        help="Measured profile to draw as points: CSV with columns 'y [mm]' and 'depth [um]', or"
        " 'height [um]' with worn material negative; or a surface, SDF or X3P. May be repeated.",
        show_default=False,
    ),
]
Angle = Annotated[
    str | None,
    typer.Option(
        "--angle",
        metavar="ANGLE",
        help="Angle of the cam at which --measured was measured: '112 deg'; default: where the cam"
        " is worn deepest.",
        show_default=False,
    ),
]
Level = Annotated[
    bool,
    typer.Option(
        "--level",
        help="Remove offset, inclination and axial shift of measured profiles, found on the surface"
        " outside the computed groove.",
    ),
]


def plot(
    file: ResultsFile,
    figure: Figure = None,
    measured: MeasuredFiles = None,
    angle: Angle = None,
    level: Level = False,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    force: Force = False,
) -> None:
    """Draw the figure of a results file of any kind."""
    path = figure if figure is not None else Path(f"{file.stem}.png")
    from wearsim.results import (
        DissipationResult,
        IdentificationResult,
        open_results,
        refuse_inputs,
    )

    refuse_inputs(path, [file], "the figure")
    refuse_inputs(path, measured or [], "a measured profile")
    result = open_results(file)
    check_figure(path, force)
    if measured and isinstance(result, DissipationResult | IdentificationResult):
        raise typer.BadParameter(
            f"requires wear tests; {file} holds {result.raw.schema.holds}", param_hint="--measured"
        )
    choice = profile_choice(columns, units, row, mean_rows, at)
    draw(result, path, measured_profiles(measured or [], choice, [result], level, angle))
    note(f"figure: {path}")


def measured_profiles(
    files: Sequence[Path],
    choice: ProfileChoice,
    results: Sequence[object],
    level: bool,
    angle: str | None = None,
) -> list[Measured]:
    """Return the profiles of measured files, levelled against the first result if required.

    How signs were read and the residuals go to stderr.
    """
    if not files:
        for name, given in (("--level", level), ("--angle", angle)):
            if given:
                raise typer.BadParameter("needs a measured profile, --measured", param_hint=name)
        return []
    at = None
    if angle is not None:
        from wearsim.quantities import quantity

        with checking("--angle"):
            at = quantity(angle, "rad")
    from wearsim.errors import ScenarioError
    from wearsim.profiles import load_profile, sign_note
    from wearsim.report.measured import Measured, computed_profile, levelled, residual_text, rms
    from wearsim.report.text import shown
    from wearsim.results import EnsembleResult, Result
    from wearsim.results.ensemble.life import LifeResult

    read = [load_profile(file, choice) for file in files]
    each = zip(files, read, strict=True)
    write_notes(filter(None, [sign_note(one, choice, str(file)) for file, one in each]))
    each = zip(files, read, strict=True)
    profiles = [Measured(file.stem, one.y, one.height, at) for file, one in each]
    tests = (
        one
        for one in results
        if isinstance(one, Result | EnsembleResult) and not isinstance(one, LifeResult)
    )
    test = next(tests, None)
    if at is not None and not (isinstance(test, Result) and test.scenario.cam is not None):
        raise typer.BadParameter(
            "is for the run of a cam; ensembles hold the deepest groove", param_hint="--angle"
        )
    if test is None:
        return profiles
    computed = computed_profile(test, at)
    for place, profile in enumerate(profiles):
        try:
            corrected = levelled(profile, computed)
        except ScenarioError:
            if level:
                raise
            corrected = profile
        text = f"{profile.label}: {residual_text(corrected if level else profile, computed)}"
        if level:
            profiles[place] = corrected
        elif rms(corrected, computed) < _MISALIGNED * rms(profile, computed):
            text += f"; rms {shown(rms(corrected, computed), 'um', 3)} with --level"
        note(text)
    return profiles


def draw(
    result: Result | DissipationResult | EnsembleResult | IdentificationResult,
    path: Path,
    measured: Sequence[Measured] = (),
) -> None:
    """Write the figure of a result.

    Parameters
    ----------
    result : Result, DissipationResult, EnsembleResult or IdentificationResult
    path : Path
        Name of the figure.
    measured : sequence of Measured
        Profiles drawn over those of a run or an ensemble.
    """
    from wearsim.report.figures.result import figure_of
    from wearsim.report.parts import save_figure

    save_figure(figure_of(result, measured), path)


def show(file: ResultsFile, json: Json = False) -> None:
    """Show the content of a results file and the end state."""
    from wearsim.cli.render import ensemble_table, life_table
    from wearsim.cli.render.dissipation_table import write_spread
    from wearsim.cli.render.failure import failure_rows
    from wearsim.report import summary
    from wearsim.report.text import count
    from wearsim.results import (
        DissipationResult,
        EnsembleResult,
        IdentificationResult,
        open_results,
    )
    from wearsim.results.ensemble.life import LifeResult

    result = open_results(file)
    if isinstance(result, IdentificationResult):
        from wearsim.cli.render.identification import identification_json, write_identification

        if json:
            write_json({**identification_json(result), **_origin(result.raw)})
        else:
            write_identification(result, summary.sources(result.raw))
        return
    if json:
        data: dict[str, Any]
        if isinstance(result, DissipationResult):
            data = summary.dissipation_json(result)
        elif isinstance(result, LifeResult):
            data = life_table.life_json(result)
        elif isinstance(result, EnsembleResult):
            data = ensemble_table.ensemble_json(result)
        else:
            data = {
                **summary.run_json(result),
                "total_passes": result.raw.total_passes,
                "tolerance": result.raw.tolerance,
                "record_passes": result.record_passes,
            }
        write_json({**data, **_origin(result.raw)})
        return
    if isinstance(result, DissipationResult):
        write_spread(result, summary.sources(result.raw))
    elif isinstance(result, LifeResult):
        life_table.write_life(result, summary.sources(result.raw))
    elif isinstance(result, EnsembleResult):
        groups = [(f"random {item['name']}", item["text"]) for item in result.raw.groups]
        ensemble_table.write_ensemble(result, [*groups, *summary.sources(result.raw)])
    else:
        first, last = (count(float(result.record_passes[place])) for place in (0, -1))
        rows = [
            ("test", summary.standing(result)),
            *failure_rows(result),
            ("contact model", result.described_model),
            ("stepper", f"{result.stepper}, tolerance {result.raw.tolerance:g}"),
            ("seed", str(result.raw.seed)),
            *summary.draws(result),
            ("records", f"{len(result.record_passes)}, at passes {first} to {last}"),
            ("strips", str(len(result.y))),
            *summary.effort(result),
        ]
        write_table(result.title, [*rows, *summary.sources(result.raw)])
        title = "end state" if result.finished else "current state"
        title = "state before the failure" if result.failure else title
        write_table(title, summary.end_state(result))
    write_notes(result.notes, result.warnings)
    if isinstance(result, EnsembleResult):
        ensemble_table.warn_of_failures(result)


def _origin(raw: StudyData) -> dict[str, Any]:
    """Return scenario, input files, plugins and software of a study."""
    return {
        "scenario_file": raw.scenario_file,
        "scenario_sha256": raw.sha256,
        "scenario": raw.scenario_text,
        "files": list(raw.files),
        "plugins": raw.plugins,
        "software": raw.software,
        "seed": raw.seed,
        "created": raw.created,
    }


Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE.h5 FILE.h5...",
        help="Results files of runs and ensembles; all others are compared with the first.",
        show_default=False,
    ),
]
Observable = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Quantity to compare: depth, width, worn_volume, dissipated_energy...",
    ),
]


def compare(
    files: Files,
    observable: Observable = "depth",
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Compare runs and ensembles, with confidence intervals."""
    if len(files) < 2:
        raise typer.BadParameter(
            f"there is one file, {files[0]}; give another one to compare", param_hint="FILE.h5"
        )
    from wearsim.results import refuse_inputs
    from wearsim.studies.ensemble.compare import observables_of

    if figure is not None:
        refuse_inputs(figure, files, "the comparison")
    results = [_open(file) for file in files]
    check_figure(figure, force)
    labels = _labels(files)
    for label, result in zip(labels, results, strict=True):
        known = observables_of(result)
        if observable not in known:
            raise typer.BadParameter(
                f"{label} has no '{observable}', expected one of {', '.join(known)}",
                param_hint="--observable",
            )
    from wearsim.cli.render.ensemble_table import report_comparison

    report_comparison(results, labels, observable, "", figure, json)


def _open(file: Path) -> Result | EnsembleResult:
    from wearsim.errors import ResultsFileError
    from wearsim.results import (
        DissipationResult,
        EnsembleResult,
        IdentificationResult,
        open_results,
    )
    from wearsim.results.ensemble.life import LifeResult

    result = open_results(file)
    if isinstance(result, DissipationResult | IdentificationResult):
        raise ResultsFileError(
            f"{file}: holds {result.raw.schema.holds}; only runs and ensembles can be compared"
        )
    if isinstance(result, LifeResult):
        raise ResultsFileError(f"{file}: holds lives; `wearsim life A.h5 B.h5` compares them")
    if isinstance(result, EnsembleResult) and result.count == 0:
        raise ResultsFileError(f"{file}: has no completed realisation; nothing to compare")
    return result


def _labels(files: list[Path]) -> list[str]:
    """Return the names of the files, with their folders where the names are not unique."""
    stems = [file.stem for file in files]
    if len(set(stems)) == len(stems):
        return stems
    names = [str(file) for file in files]
    for name in names:
        if names.count(name) > 1:
            raise typer.BadParameter(f"{name} is given twice", param_hint="FILE.h5")
    return names


Folder = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        help="Folder for the CSV files, by default the name of the results file.",
        show_default=False,
    ),
]


Decimal = Annotated[
    str,
    typer.Option(
        "--decimal", metavar="SIGN", help="Decimal sign: '.', or ',' with semicolons between cells."
    ),
]


def export(
    file: ResultsFile, output: Folder = None, decimal: Decimal = ".", force: Force = False
) -> None:
    """Write a results file as CSV, with units in the headers."""
    if decimal not in {".", ","}:
        raise typer.BadParameter(f"'{decimal}' is neither '.' nor ','", param_hint="--decimal")
    from wearsim.results import export_csv, open_results

    sign: Literal[".", ","] = "," if decimal == "," else "."
    folder = output if output is not None else Path(file.stem)
    for path in export_csv(open_results(file), folder, force=force, decimal=sign):
        typer.echo(str(path))
