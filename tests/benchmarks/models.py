"""Every contact model against the exact theory and the other models, as Markdown tables.

``python -m tests.benchmarks.models -o out/models.json``. Contact models of other
distributions, such as the plugin template, which is added here, appear in the tables of worn
profiles and whole tests with their default options and every option that changes the normal
contact.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.benchmarks.table import part, save_tables
from tests.benchmarks.wear_tests import SCENARIOS
from wearsim import load_scenario, run
from wearsim.errors import WearsimError
from wearsim.plugins.template import template_folder
from wearsim.report.text import brief
from wearsim_bench.contact.accuracy import (
    PowerErrors,
    WornErrors,
    choose_model,
    hard_case_errors,
    random_case_errors,
    solved,
    worn_errors,
)
from wearsim_bench.contact.cases import elliptic_cases
from wearsim_bench.contact.methods import normal_methods
from wearsim_bench.exact_solutions import WORN
from wearsim_bench.figures.table import markdown_table
from wearsim_bench.measure.machine import this_machine
from wearsim_bench.measure.timing import best_short, timed

#: contact model and options by label
TANGENTIAL: dict[str, tuple[str, dict[str, Any]]] = {
    "strip, on exact Hertz": ("hertz", {}),
    "fastrip, on exact Hertz": ("hertz", {"tangential": "fastrip"}),
    "fastsim, elliptic bound": ("hertz", {"tangential": "fastsim"}),
    "fastsim, elliptic, one flexibility": (
        "hertz",
        {"tangential": "fastsim", "flexibility": "one"},
    ),
    "fastsim, parabolic bound (`hertz-fastsim`)": ("hertz-fastsim", {}),
    "fastsim, parabolic, one flexibility": ("hertz-fastsim", {"flexibility": "one"}),
    "strip, on `slender` (the default)": ("slender", {}),
}
LONG = 3.0  # b/a from which the theories of strips apply
FAILED = "no: "


def normal_models() -> dict[str, tuple[str, dict[str, Any]]]:
    """Return all registered contact models, with every option that changes the normal contact."""
    return {method.name: (method.model, dict(method.options)) for method in normal_methods()}


def drawn_table(repetitions: int) -> str:
    """Return the errors of the tangential theories on random and on hard cases."""
    lines = []
    for label, (name, options) in TANGENTIAL.items():
        model = choose_model(name, **options)
        case = elliptic_cases("partial")[0]
        seconds = best_short(lambda model=model, case=case: solved(model, case), repetitions)
        cells = [label]
        for kind in ("paper", "partial"):
            found = random_case_errors(model, kind)
            cells += [_spread(found), percent(found.strips)]
        cells += [_spread(hard_case_errors(model, LONG)), brief(seconds)]
        lines.append(cells)
    head = (
        "tangential theory",
        *("paper's inputs: power, rms / worst", "P_l(y), L2"),
        *("partial slip with spin: power, rms / worst", "P_l(y), L2"),
        *(f"hard cases, b/a >= {LONG:g}: power, rms / worst", "one contact, prepared and solved"),
    )
    return markdown_table(head, lines) + "\n"


def _spread(errors: PowerErrors) -> str:
    return f"{percent(errors.rms)} / {percent(errors.worst)}"


def percent(error: float) -> str:
    """Return an error without its sign."""
    return f"{100.0 * abs(error):.2g} %"


def worn_table() -> str:
    """Return the errors of the normal models on worn profiles."""
    lines = []
    for profile in WORN:
        for label, (name, options) in normal_models().items():
            try:
                cells = _worn_cells(worn_errors(choose_model(name, **options), profile))
            except WearsimError as error:
                cells = [FAILED + str(error).split(";", maxsplit=1)[0], *[""] * 6]
            lines.append([profile.replace("_", " "), label, *cells])
    head = (
        *("profile", "contact model", "line load, L1", "half-length, L1", "approach"),
        *("peak pressure", "P_l(y), L2: full sliding", "partial slip", "with spin"),
    )
    return markdown_table(head, lines) + "\n"


def _worn_cells(errors: WornErrors) -> list[str]:
    return [
        percent(errors.line_load),
        percent(errors.half_length),
        part(errors.approach),
        part(errors.peak_pressure),
        *(percent(value) for value in errors.dissipation.values()),
    ]


def whole_table(share: float) -> str:
    """Return the final state and the cost of rig-450min with every model; `share` shortens it."""
    lines = []
    for label, (name, options) in normal_models().items():
        lines.append([label, *_whole_cells(name, options, share)])
    head = (
        *("contact model", "depth", "width", "worn volume", "estimated error of depth"),
        *("stepper", "steps", "contact solves", "time"),
    )
    return markdown_table(head, lines) + "\n"


def _whole_cells(name: str, options: dict[str, Any], share: float) -> list[str]:
    overrides: dict[str, object] = {"operation.duration": f"{450 * share:.12g} min"}
    overrides |= {"contact.model": name} | {f"contact.{key}": v for key, v in options.items()}
    scenario = load_scenario(SCENARIOS / "rig-450min.toml", overrides=overrides)
    try:
        result = run(scenario)
    except WearsimError as error:
        return [FAILED + str(error), *[""] * 7]
    seconds = timed(lambda: run(scenario))
    return [
        f"{result.depth[-1] * 1e6:.2f} um",
        f"{result.width[-1] * 1e3:.2f} mm",
        f"{result.worn_volume[-1] * 1e9:.3f} mm^3",
        percent(float(result.depth_error[-1] / result.depth[-1])),
        result.stepper,
        str(result.steps),
        str(result.solves[-1]),
        brief(seconds),
    ]


def report(
    on_progress: Callable[[str], object], share: float = 1.0, repetitions: int = 5
) -> dict[str, str]:
    """Measure everything and return the tables; call `on_progress` with each finished one."""
    tables = {}
    parts: tuple[tuple[str, Callable[[], str]], ...] = (
        ("Tangential theories on elliptic contacts", lambda: drawn_table(repetitions)),
        ("Normal models on worn profiles, closed-form strips for the tractions", worn_table),
        ("rig-450min to its end with every model", lambda: whole_table(share)),
    )
    for title, measure in parts:
        tables[title] = f"## {title}\n\n{measure()}\n"
        on_progress(tables[title])
    return tables


def install_template(folder: Path) -> None:
    """Add the plugin template to Python's path unless it is installed."""
    if any(point.value == "wearsim_template" for point in entry_points(group="wearsim")):
        return
    info = folder / "wearsim_template-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: wearsim-template\nVersion: 0.1.0\n"
    )
    (info / "entry_points.txt").write_text("[wearsim]\nwinkler = wearsim_template\n")
    sys.path[:0] = [str(folder), str(template_folder() / "src")]


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and write them to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.models", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorten the whole tests")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="also write it to this file"
    )
    options_given = parser.parse_args(arguments)

    def on_progress(text: str) -> None:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()

    on_progress(f"Measured on {this_machine()}.\n")
    with TemporaryDirectory() as folder:
        install_template(Path(folder))
        tables = report(on_progress, *((0.002, 1) if options_given.quick else ()))
    if options_given.output is not None:
        save_tables(options_given.output, "python -m tests.benchmarks.models", tables)


if __name__ == "__main__":
    main()
