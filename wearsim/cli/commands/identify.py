"""`wearsim identify`: the wear factor of measured grooves, and whether it scatters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import (
    Columns,
    FigureOption,
    Force,
    Json,
    MeanRows,
    Quiet,
    Row,
    ScenarioFile,
    Seed,
    Settings,
    Units,
    check_figure,
    checking,
    profile_choice,
    read_scenario,
    refuse_existing,
    refuse_same_file,
    write_json,
    write_list,
)

if TYPE_CHECKING:
    from wearsim.scenario import Scenario

Profiles = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="T1.csv T2.csv...",
        help="Measured profiles, one of each test: CSV with columns 'y [mm]' and 'height [um]',"
        " worn is negative, or 'depth [um]'; or a surface, SDF or X3P, whose lines are averaged.",
        show_default=False,
    ),
]
Tests = Annotated[
    Path | None,
    typer.Option(
        "--tests",
        metavar="TESTS.toml",
        help="Tests as [[test]] tables: profile, depth with depth_std, or lift of a cam; angle of a"
        " cam, before, at, group, set, std, body, shoulders, curvature, runout, columns, units.",
        show_default=False,
    ),
]
Before = Annotated[
    str | None,
    typer.Option(
        "--before",
        metavar="B1.csv,...",
        help="Profiles of the same places before the tests, in the order of the tests.",
        show_default=False,
    ),
]
Shoulders = Annotated[
    str | None,
    typer.Option(
        "--shoulders",
        metavar="DISTANCE",
        help="Distance from the middle of the groove beyond which the surface is unworn: '9 mm';"
        " default: beyond the predicted groove.",
        show_default=False,
    ),
]
Curvature = Annotated[
    bool,
    typer.Option(
        "--curvature",
        help="Fit a curvature of each trace, as of a bow of the instrument's guide, beside offset"
        " and inclination; needs unworn shoulders.",
    ),
]
Share = Annotated[
    str | None,
    typer.Option(
        "--share",
        metavar="k=cylinder,roller",
        help="One unknown factor of K/H of both bodies, in the ratio of the scenario.",
        show_default=False,
    ),
]
Fix = Annotated[
    str | None,
    typer.Option(
        "--fix",
        metavar="INPUT=VALUE,...",
        help="Inputs that are known and equal in all tests: friction=0.1,load=310 N.",
        show_default=False,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="OUT.h5", help="Results file; default: none.", show_default=False
    ),
]
PosteriorFile = Annotated[
    Path | None,
    typer.Option(
        "--posterior",
        metavar="K.toml",
        help="Distribution of K/H of the next specimen, as a table of a scenario; beside it K.csv,"
        " with what is not known of its median and scatter, for `wearsim life --posterior`.",
        show_default=False,
    ),
]
PlanFlag = Annotated[
    bool,
    typer.Option("--plan", help="Power of planned tests instead of measured ones; needs -n."),
]
Numbers = Annotated[
    str | None,
    typer.Option(
        "-n", metavar="3:60", help="Numbers of planned tests: 3:60 or 3,8,20.", show_default=False
    ),
]
Measured = Annotated[
    str | None,
    typer.Option(
        "--measured",
        metavar="INPUT=SD,...",
        help="Inputs that are measured in every planned test, with the standard deviation of the"
        " logarithm: load=0.1,creepage=0.1.",
        show_default=False,
    ),
]
Draws = Annotated[
    int | None,
    typer.Option(
        min=16,
        metavar="M",
        help="Draws of the inputs other than K/H; default: 256, 768 where traces leave few of them,"
        " 128 where a wear test is needed for each of several K/H.",
        show_default=False,
    ),
]
Negligible = Annotated[
    float,
    typer.Option(min=0.0, metavar="SCATTER", help="Scatter of ln K/H that is negligible."),
]


def identify(
    scenario: ScenarioFile,
    profiles: Profiles = None,
    tests: Tests = None,
    before: Before = None,
    shoulders: Shoulders = None,
    curvature: Curvature = False,
    share: Share = None,
    fix: Fix = None,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    output: Output = None,
    posterior: PosteriorFile = None,
    figure: FigureOption = None,
    plan: PlanFlag = False,
    numbers: Numbers = None,
    measured: Measured = None,
    draws: Draws = None,
    negligible: Negligible = 0.2,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Identify the wear factor from measured grooves, and whether it scatters."""
    check_figure(figure, force, "--figure")
    given = {"seed": seed}
    options = [f"{key}={value}" for key, value in given.items() if value is not None]
    loaded = read_scenario(scenario, [*(settings or []), *options])
    from wearsim.studies.identify.inputs import fixed

    overrides: dict[str, object] = {}
    if fix is not None:
        with checking("--fix"):
            overrides = fixed(fix)
        loaded = loaded.changed(overrides)
    if plan:
        without = {"profiles": profiles, "--tests": tests, "-o": output, "--posterior": posterior}
        for name, value in without.items():
            if value:
                raise typer.BadParameter(f"takes no {name}", param_hint="--plan")
        _plan(loaded, numbers, measured, draws, negligible, figure, json, quiet)
        return
    for name, text in (("-n", numbers), ("--measured", measured)):
        if text is not None:
            raise typer.BadParameter("is for --plan", param_hint=name)
    if (tests is None) == (not profiles):
        raise typer.BadParameter(
            "give the profiles of the tests, or --tests with a file of them; not both",
            param_hint="T1.csv T2.csv...",
        )
    choice = profile_choice(columns, units, row, mean_rows, None)
    if tests is not None and (before or shoulders):
        raise typer.BadParameter(
            "give before and shoulders in the tests file", param_hint="--before or --shoulders"
        )
    inputs = [*loaded.paths, *(profiles or []), *([tests] if tests else [])]
    levels = None if posterior is None else posterior.with_suffix(".csv")
    for path in (posterior, levels):
        if path is not None:
            refuse_existing(path, force, "--posterior")
    for path in (figure, posterior, levels):
        refuse_same_file(path, output if output is not None else Path(), inputs)
    distance = None
    if shoulders is not None:
        from wearsim.quantities import quantity

        with checking("--shoulders"):
            distance = quantity(shoulders, "m")
    bodies = _shared(share)
    from wearsim.cli.progress import Counter
    from wearsim.studies.identify.api import identify as study
    from wearsim.studies.kernels import kernels_of

    with (
        checking("--before" if before else "T1.csv T2.csv..."),
        Counter(quiet, kernels=lambda: kernels_of(loaded)) as counter,
    ):
        result = study(
            loaded,
            tests if tests is not None else list(profiles or []),
            output,
            before=[Path(name.strip()) for name in before.split(",")] if before else [],
            shoulders=distance,
            curvature=curvature,
            share=bodies,
            fix=overrides,
            choice=choice,
            draws=draws,
            negligible=negligible,
            force=force,
            on_progress=counter,
        )
    _finish(result, posterior, figure, json)


def _finish(result: Any, posterior: Path | None, figure: Path | None, json: bool) -> None:
    """Write posterior, figure, and the table or JSON."""
    from wearsim.cli.render import draw_figure, show_view
    from wearsim.report.page.page import save_text

    files = {"results file": result.path, "posterior": posterior, "figure": figure}
    if posterior is not None:
        save_text(result.posterior_toml(), posterior)
        files["both levels"] = posterior.with_suffix(".csv")
        save_text(result.posterior_csv(), posterior.with_suffix(".csv"))
    draw_figure(result.view.panels(), figure)
    more = {"posterior": posterior, "figure": figure}
    show_view(result.view, json=json, files=files, more=more)


def _shared(text: str | None) -> tuple[str, ...]:
    """Return the bodies of --share."""
    if text is None:
        return ()
    name, equals, bodies = text.partition("=")
    found = tuple(body.strip() for body in bodies.split(","))
    if name.strip() != "k" or not equals or sorted(found) != ["cylinder", "roller"]:
        raise typer.BadParameter(
            f"'{text}' is unknown, expected k=cylinder,roller", param_hint="--share"
        )
    return found


def _plan(
    scenario: Scenario,
    numbers: str | None,
    measured: str | None,
    draws: int | None,
    negligible: float,
    figure: Path | None,
    json: bool,
    quiet: bool,
) -> None:
    """Write the power of planned tests."""
    from wearsim.cli.progress import Counter
    from wearsim.cli.render import draw_figure
    from wearsim.studies.identify.panels import power_sheet
    from wearsim.studies.identify.planning import plan_data, plan_tables, plan_tests, sizes
    from wearsim.studies.kernels import kernels_of

    if numbers is None:
        raise typer.BadParameter("is needed for --plan: 3:60 or 3,8,20", param_hint="-n")
    first, colon, last = numbers.partition(":")
    try:
        if colon:
            counts = sizes(int(first), int(last))
        else:
            counts = sorted({int(part) for part in numbers.split(",")})
    except (ValueError, OverflowError):
        counts = []
    if not counts or counts[0] < 2 or counts[-1] > 1000 or (colon and int(first) > int(last)):
        raise typer.BadParameter(
            f"'{numbers}' is no range of 2 to 1000 tests, expected 3:60 or 3,8,20", param_hint="-n"
        )
    stds: dict[str, float] = {}
    for part in measured.split(",") if measured else []:
        name, _, value = part.partition("=")
        try:
            stds[name.strip()] = float(value)
        except ValueError:
            stds[name.strip()] = 0.0
        if stds[name.strip()] <= 0.0:
            raise typer.BadParameter(
                f"'{part}' is no input with a standard deviation above 0, such as load=0.1",
                param_hint="--measured",
            )
    with Counter(quiet, kernels=lambda: kernels_of(scenario)) as counter:
        designs = plan_tests(
            scenario,
            counts,
            stds,
            negligible=negligible,
            draws=draws,
            on_progress=counter,
        )
    draw_figure(power_sheet(designs, scenario.title), figure)
    if json:
        write_json({**plan_data(designs), "figure": figure})
        return
    typer.echo(scenario.title)
    for table, sentences in plan_tables(designs):
        typer.echo(f"\n{table.title}")
        write_list(table.heads, table.rows)
        typer.echo("\n".join(sentences))
    if figure is not None:
        typer.echo(f"figure: {figure}")
