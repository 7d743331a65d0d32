"""Verbs for one contact: contact, and dissipation for many realisations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import (
    At,
    Columns,
    Figure,
    FigureOption,
    Force,
    Json,
    MeanRows,
    Quiet,
    Realisations,
    Row,
    ScenarioFile,
    Seed,
    Settings,
    Units,
    check_figure,
    checking,
    note,
    profile_choice,
    read_scenario,
    refuse_same_file,
    results_option,
    write_json,
    write_notes,
    write_table,
)

if TYPE_CHECKING:
    from wearsim.scenario import Scenario
    from wearsim.studies.contact.single import ContactStudy


ProfileFile = Annotated[
    Path | None,
    typer.Option(
        "--profile",
        metavar="FILE",
        help="Profile of the cylinder: CSV with columns 'y [mm]' and 'height [um]', worn is"
        " negative, or 'depth [um]'; or a surface, SDF or X3P.",
        show_default=False,
    ),
]
Cutoff = Annotated[
    str | None,
    typer.Option(
        "--filter",
        metavar="CUTOFF",
        help="Cutoff wavelength of a Gaussian filter that removes roughness from the profile"
        " (ISO 16610-21): '0.8 mm'.",
        show_default=False,
    ),
]
Against = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL",
        help="Also solve the contact with this contact model, such as halfspace, and show the"
        " difference.",
        show_default=False,
    ),
]


def contact(
    scenario: ScenarioFile,
    profile: ProfileFile = None,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    cutoff: Cutoff = None,
    settings: Settings = None,
    against: Against = None,
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Solve one contact: the first roller at the start of the load."""
    check_figure(figure, force)
    loaded = read_scenario(scenario, settings)
    from wearsim.cli.progress import Display
    from wearsim.errors import PluginError
    from wearsim.input_files import read_input
    from wearsim.profiles import ProfileChoice, gaussian_filtered, load_profile, sign_note
    from wearsim.quantities import quantity
    from wearsim.results import refuse_inputs
    from wearsim.studies.contact.comparison import reference_spec
    from wearsim.studies.contact.single import study_contact
    from wearsim.studies.dry_run import profile_data
    from wearsim.studies.dry_run_table import profile_rows
    from wearsim.studies.kernels import kernels_of

    if against is not None:
        try:
            reference_spec(against)
        except PluginError as error:
            raise typer.BadParameter(str(error), param_hint="--against") from error
    if figure is not None:
        refuse_inputs(figure, loaded.paths)
        refuse_inputs(figure, [profile] if profile else [], "the profile")
    choice = profile_choice(columns, units, row, mean_rows, at)
    if profile is None and (cutoff is not None or choice != ProfileChoice()):
        message = "is needed for --columns, --units, --row, --mean-rows, --at and --filter"
        raise typer.BadParameter(message, param_hint="--profile")
    cylinder, files = loaded.cylinder, dict(loaded.files)
    if profile is not None:
        measured, wavelength = load_profile(profile, choice), None
        if cutoff is not None:
            with checking("--filter"):
                wavelength = quantity(cutoff, "m")
                measured = gaussian_filtered(measured, wavelength)
        files[str(profile)] = read_input(profile, choice)
        cylinder = replace(
            cylinder, profile=measured, profile_file=str(profile), profile_filter=wavelength
        )
    start = profile_data(cylinder, files)
    automatic = loaded.contact.model == "auto"  # all models that it takes have fields
    has_fields = automatic or loaded.contact.spec.capabilities.fields
    with_fields = figure is not None and has_fields

    def kernels() -> set[str]:
        return kernels_of(loaded, "contact", with_fields)

    with Display(quiet=False, kernels=kernels, transient=True):
        study = study_contact(loaded, cylinder.profile, with_fields, True, against)
    notes = [*study.notes, *_notes_on_means(loaded)]
    if cylinder.profile and profile and (sign := sign_note(cylinder.profile, choice, str(profile))):
        notes.append(sign)
    if figure is not None and not has_fields:
        notes.append(f"model '{study.model}' gives no fields; the figure shows its strips only")
    if json:
        write_json({**_data(loaded, study, notes, figure), "profile": start})
    else:
        from wearsim.report.summary import contact_line

        write_table(loaded.title, [*profile_rows(start), *_rows(study)])
        if study.reference is not None:
            write_table(f"difference from '{study.reference.model}'", _difference_rows(study))
        typer.echo(contact_line(study))
    if figure is not None:
        from wearsim.report.figures.contact import contact_figure
        from wearsim.report.parts import save_figure

        save_figure(contact_figure(study, loaded.title), figure)
    if not json:
        write_notes(notes, study.warnings)
        if figure:
            note(f"figure: {figure}")


def _notes_on_means(scenario: Scenario) -> list[str]:
    """Return notes that name the random inputs, which are set to their means."""
    fields = [item.name for item in scenario.random if item.role == "field"]
    others = [item.name for item in scenario.random if item.role != "field"]
    notes = [f"random inputs are set to their means: {', '.join(others)}"] if others else []
    if fields:
        notes.append(f"random fields are set to the means of their marginals: {', '.join(fields)}")
    return notes


def _rows(study: ContactStudy) -> list[tuple[str, str]]:
    """Return the numbers of a contact in engineering units."""
    import numpy as np

    from wearsim.report.parts import patch_edges
    from wearsim.report.text import NOTHING, shown

    point, solution = study.point, study.solution
    edges = patch_edges(solution.y, solution.half_length)
    rounding = 1e-12 * point.normal_force * study.grid.spacing * study.grid.strips
    moment = solution.spin_moment if abs(solution.spin_moment) > rounding else 0.0
    return [
        ("contact model", study.described_model),
        ("strips", f"{study.grid.strips} of {shown(study.grid.spacing, 'um')}"),
        ("normal force", shown(point.normal_force, "N")),
        ("rolling speed", shown(point.rolling_speed, "m/s")),
        ("friction coefficient", shown(float(np.mean(point.friction)), "1")),
        ("longitudinal creepage", shown(solution.longitudinal_creepage, "1")),
        ("lateral creepage", shown(point.creepage.lateral, "1")),
        ("spin", f"{shown(point.creepage.spin, '1')} 1/m" if point.creepage.spin else "0"),
        ("patch length 2a", shown(2.0 * float(solution.half_length.max()), "mm")),
        ("patch width", shown(edges[1] - edges[0], "mm") if edges else NOTHING),
        ("peak pressure", shown(solution.peak_pressure, "MPa")),
        ("approach", shown(solution.approach, "um")),
        ("longitudinal force", shown(solution.force_x, "N")),
        ("lateral force", shown(solution.force_y, "N")),
        ("spin moment", shown(moment, "N mm")),
        ("dissipated power", shown(solution.power, "W")),
        ("adhesion fraction", shown(round(solution.adhesion_fraction, _DIGITS), "%")),
    ]


def _difference_rows(study: ContactStudy) -> list[tuple[str, str]]:
    """Return the differences from the reference, each with the reference's own error."""
    from wearsim.report.text import lapse, shown

    assert study.reference is not None
    assert study.errors is not None
    own = vars(study.reference.own)
    rows = []
    for name, error in vars(study.errors).items():
        sign = "" if name in {"dissipation", "greatest"} else "+" if error >= 0.0 else "-"
        text = f"{sign}{shown(abs(round(error, _DIGITS)), '%', 2)}"
        theirs = shown(round(own[name], _DIGITS), "%", 2)
        rows.append((_DIFFERENCES[name], f"{text}, its own error {theirs}"))
    return [*rows, ("time of the reference", lapse(study.reference.seconds))]


_DIGITS = 10  # after the point, of a fraction; beyond them is rounding
_DIFFERENCES = {
    "dissipation": "P_l(y), L2 over the strips",
    "greatest": "P_l(y), greatest over its maximum",
    "power": "dissipated power",
    "peak_pressure": "peak pressure",
    "half_length": "greatest half-length",
    "adhesion_fraction": "adhesion fraction, in points",
}


def _reference_data(study: ContactStudy) -> dict[str, Any] | None:
    """Return the reference in SI units, the differences from it and its own errors."""
    reference, errors = study.reference, study.errors
    if reference is None or errors is None:
        return None
    return {
        "model": reference.model,
        "errors": vars(errors),
        "own_errors": vars(reference.own),
        "power_W": reference.power,
        "peak_pressure_Pa": reference.peak_pressure,
        "half_length_m": reference.half_length,
        "adhesion_fraction": reference.adhesion_fraction,
        "seconds": reference.seconds,
        "strips": {
            "y_m": reference.y,
            "line_load_N_per_m": reference.line_load,
            "dissipation_W_per_m": reference.dissipation,
        },
    }


def _times(error: float | None, value: float) -> float | None:
    """Return an error from a relative one, if there is any."""
    return None if error is None else error * value


def _data(
    scenario: Scenario, study: ContactStudy, notes: list[str], figure: Path | None
) -> dict[str, Any]:
    """Return the contact and its strips in SI units."""
    from wearsim.report.parts import patch_edges

    point, solution = study.point, study.solution
    edges = patch_edges(solution.y, solution.half_length)
    return {
        "title": scenario.title,
        "model": study.model,
        "described_model": study.described_model,
        "normal_force_N": point.normal_force,
        "rolling_speed_m_per_s": point.rolling_speed,
        "friction": point.friction,
        "longitudinal_creepage": solution.longitudinal_creepage,
        "lateral_creepage": point.creepage.lateral,
        "spin_per_m": point.creepage.spin,
        "patch_length_m": 2.0 * float(solution.half_length.max()),
        "patch_width_m": edges[1] - edges[0] if edges else 0.0,
        "peak_pressure_Pa": solution.peak_pressure,
        "approach_m": solution.approach,
        "force_x_N": solution.force_x,
        "force_y_N": solution.force_y,
        "spin_moment_N_m": solution.spin_moment,
        "power_W": solution.power,
        "adhesion_fraction": solution.adhesion_fraction,
        "iterations": solution.iterations,
        "power_error_W": _times(study.grid_error, solution.power),
        "peak_pressure_error_Pa": _times(study.pressure_error, solution.peak_pressure),
        "solve_seconds": study.seconds,
        "strips": {
            "y_m": solution.y,
            "half_length_m": solution.half_length,
            "line_load_N_per_m": solution.line_load,
            "dissipation_W_per_m": solution.dissipation,
        },
        "against": _reference_data(study),
        "notes": notes,
        "warnings": study.warnings,
        "figure": figure,
    }


Output = Annotated[Path | None, results_option("-dissipation.h5")]
Plan = Annotated[
    str | None,
    typer.Option(
        metavar="PLAN",
        help="Sampling design: monte-carlo, latin-hypercube or sobol; default: that of the"
        " scenario.",
        show_default=False,
    ),
]
_STOPPING = (
    "stopping after the current realisations, results are kept; repeat to stop at once and lose"
    " them"
)


def dissipation(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Output = None,
    figure: FigureOption = None,
    plan: Plan = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Solve one contact for many realisations of its random inputs."""
    check_figure(figure, force, "--figure")
    given = {"sampling.plan": plan, "seed": seed}
    options = [f"{key}={value}" for key, value in given.items() if value is not None]
    loaded = read_scenario(scenario, [*(settings or []), *options])
    path = output if output is not None else Path(f"{scenario.stem}-dissipation.h5")
    refuse_same_file(figure, path, loaded.paths)
    from wearsim.cli.progress import Counter, stop_on_signals
    from wearsim.cli.render.dissipation_table import write_spread
    from wearsim.report.summary import dissipation_json, dissipation_line
    from wearsim.studies.contact.monte_carlo import dissipation as study
    from wearsim.studies.kernels import kernels_of

    watcher = Counter(quiet, kernels=lambda: kernels_of(loaded, "contacts"))
    with stop_on_signals(_STOPPING) as stop, watcher as counter:
        result = study(
            loaded,
            realisations,
            path,
            force=force,
            on_progress=counter,
            stop_requested=stop.is_set,
        )
    if figure is not None:
        from wearsim.cli.commands.results import draw

        draw(result, figure)
    if json:
        write_json({**dissipation_json(result), "figure": figure})
        return
    more = [("results file", str(result.path))]
    write_spread(result, [*more, *([("figure", str(figure))] if figure else [])])
    typer.echo(dissipation_line(result))
    write_notes(result.notes, result.warnings)
