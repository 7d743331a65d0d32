"""`wearsim identify`: the wear factor of measured grooves, and whether it scatters."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import wearsim
from wearsim.atomic_write import save_text
from wearsim.cli.render import draw_figure, show_with_figure
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
    quantity_of,
    read_scenario,
    refuse,
    refuse_existing,
    refuse_options,
    refuse_same_file,
    settings_with,
    write_json,
    write_list,
)

if TYPE_CHECKING:
    from wearsim.scenario import Scenario


def identify(
    scenario: ScenarioFile,
    profiles: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="T1.csv T2.csv...",
            help="Measured profiles, one of each test: CSV with columns 'y [mm]' and 'height [um]',"
            " worn is negative, or 'depth [um]'; or a surface, SDF or X3P, whose lines are"
            " averaged.",
            show_default=False,
        ),
    ] = None,
    tests: Annotated[
        Path | None,
        typer.Option(
            "--tests",
            metavar="TESTS.toml",
            help="Tests as [[test]] tables: profile, depth with depth_std, or lift of a cam; angle"
            " of a cam, before, at, group, set, std, body, shoulders, curvature, runout,"
            " columns, units.",
            show_default=False,
        ),
    ] = None,
    before: Annotated[
        str | None,
        typer.Option(
            "--before",
            metavar="B1.csv,...",
            help="Profiles of the same places before the tests, in the order of the tests.",
            show_default=False,
        ),
    ] = None,
    shoulders: Annotated[
        str | None,
        typer.Option(
            "--shoulders",
            metavar="DISTANCE",
            help="Distance from the middle of the groove beyond which the surface is unworn: '9"
            " mm'; default: beyond the predicted groove.",
            show_default=False,
        ),
    ] = None,
    curvature: Annotated[
        bool,
        typer.Option(
            "--curvature",
            help="Fit a curvature of each trace, as of a bow of the instrument's guide, beside"
            " offset and inclination; needs unworn shoulders.",
        ),
    ] = False,
    share: Annotated[
        str | None,
        typer.Option(
            "--share",
            metavar="k=cylinder,roller",
            help="One unknown factor of K/H of both bodies, in the ratio of the scenario.",
            show_default=False,
        ),
    ] = None,
    fix: Annotated[
        str | None,
        typer.Option(
            "--fix",
            metavar="INPUT=VALUE,...",
            help="Inputs that are known and equal in all tests: friction=0.1,load=310 N.",
            show_default=False,
        ),
    ] = None,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT.h5",
            help="Results file; default: none.",
            show_default=False,
        ),
    ] = None,
    posterior: Annotated[
        Path | None,
        typer.Option(
            "--posterior",
            metavar="K.toml",
            help="Distribution of K/H of the next specimen, as a table of a scenario; beside it"
            " K.csv, with what is not known of its median and scatter, for `wearsim life"
            " --posterior`.",
            show_default=False,
        ),
    ] = None,
    figure: FigureOption = None,
    plan: Annotated[
        bool,
        typer.Option("--plan", help="Power of planned tests instead of measured ones; needs -n."),
    ] = False,
    numbers: Annotated[
        str | None,
        typer.Option(
            "-n",
            metavar="3:60",
            help="Numbers of planned tests: 3:60 or 3,8,20.",
            show_default=False,
        ),
    ] = None,
    measured: Annotated[
        str | None,
        typer.Option(
            "--measured",
            metavar="INPUT=SD,...",
            help="Inputs that are measured in every planned test, with the standard deviation of"
            " the logarithm: load=0.1,creepage=0.1.",
            show_default=False,
        ),
    ] = None,
    draws: Annotated[
        int | None,
        typer.Option(
            min=16,
            metavar="M",
            help="Draws of the inputs other than K/H; default: 256, 768 where traces leave few of"
            " them, 128 where a wear test is needed for each of several K/H.",
            show_default=False,
        ),
    ] = None,
    negligible: Annotated[
        float,
        typer.Option(min=0.0, metavar="SCATTER", help="Scatter of ln K/H that is negligible."),
    ] = 0.2,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Identify the wear factor from measured grooves, and whether it scatters."""
    check_figure(figure, force, "--figure")
    loaded = read_scenario(scenario, settings_with(settings, seed=seed))
    from wearsim.studies.identify.inputs import fixed

    with checking("--fix"):
        overrides: dict[str, object] = {} if fix is None else fixed(fix)
    loaded = loaded.changed(overrides) if overrides else loaded
    if plan:
        without = {"profiles": profiles, "--tests": tests, "-o": output, "--posterior": posterior}
        for name, value in without.items():
            refuse(value, f"takes no {name}", "--plan")
        _plan(loaded, numbers, measured, draws, negligible, figure, json, quiet)
        return
    refuse_options({"-n": numbers, "--measured": measured}, "is for --plan")
    refuse(
        (tests is None) == (not profiles),
        "give the profiles of the tests, or --tests with a file of them; not both",
        "T1.csv T2.csv...",
    )
    choice = profile_choice(columns, units, row, mean_rows, None)
    refuse(
        tests is not None and (before or shoulders),
        "give before and shoulders in the tests file",
        "--before or --shoulders",
    )
    inputs = [*loaded.paths, *(profiles or []), *([tests] if tests else [])]
    levels = None if posterior is None else posterior.with_suffix(".csv")
    for path in (posterior, levels):
        refuse_existing(path, force, "--posterior")
    for path in (figure, posterior, levels):
        refuse_same_file(path, output if output is not None else Path(), inputs)
    from wearsim.cli.progress import Counter, watching

    distance, bodies = quantity_of(shoulders, "m", "--shoulders"), _shared(share)
    with (
        checking("--before" if before else "T1.csv T2.csv..."),
        watching(Counter, loaded, quiet) as counter,
    ):
        result = wearsim.identify(
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
    if posterior is not None:
        save_text(result.posterior_toml(), posterior)
        save_text(result.posterior_csv(), posterior.with_suffix(".csv"))
    more = {"posterior": posterior, "both levels": levels}
    show_with_figure(
        result.view, figure, json=json, files={"results file": result.path, **more}, more=more
    )


def _shared(text: str | None) -> tuple[str, ...]:
    """Return the bodies of --share."""
    if text is None:
        return ()
    name, equals, listed = text.partition("=")
    bodies = tuple(body.strip() for body in listed.split(","))
    refuse(
        not (name.strip() == "k" and equals and sorted(bodies) == ["cylinder", "roller"]),
        f"'{text}' is unknown, expected k=cylinder,roller",
        "--share",
    )
    return bodies


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
    from wearsim.cli.progress import Counter, watching
    from wearsim.studies.identify.planning import plan_data, plan_tables, plan_tests
    from wearsim.studies.identify.view import power_sheet

    counts, stds = _sizes(numbers), _measured(measured)
    with watching(Counter, scenario, quiet) as counter:
        designs = plan_tests(
            scenario, counts, stds, negligible=negligible, draws=draws, on_progress=counter
        )
    draw_figure(lambda: power_sheet(designs, scenario.title), figure)
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


def _sizes(numbers: str | None) -> list[int]:
    """Return the numbers of planned tests of -n: "3:60" or "3,8,20"."""
    from wearsim.studies.identify.planning import sizes

    refuse(numbers is None, "is needed for --plan: 3:60 or 3,8,20", "-n")
    first, colon, last = str(numbers).partition(":")
    counts: list[int] = []
    with suppress(ValueError, OverflowError):
        counts = (
            sizes(int(first), int(last))
            if colon
            else sorted(set(map(int, str(numbers).split(","))))
        )
    refuse(
        not counts or counts[0] < 2 or counts[-1] > 1000 or (colon and int(first) > int(last)),
        f"'{numbers}' is no range of 2 to 1000 tests, expected 3:60 or 3,8,20",
        "-n",
    )
    return counts


def _measured(text: str | None) -> dict[str, float]:
    """Return the inputs of --measured with the standard deviations of their logarithms."""
    stds: dict[str, float] = {}
    for part in text.split(",") if text else []:
        name, _, value = part.partition("=")
        std = 0.0
        with suppress(ValueError):
            std = float(value)
        refuse(
            not std > 0.0,
            f"'{part}' is no input with a standard deviation above 0, such as load=0.1",
            "--measured",
        )
        stds[name.strip()] = std
    return stds
