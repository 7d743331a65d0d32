"""`wearsim show`: what is in a results file, and its end state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.arguments import Json, ResultsFile
from wearsim.cli.output import note, write_json, write_table

if TYPE_CHECKING:
    from wearsim.results import Result


def show(file: ResultsFile, json: Json = False) -> None:
    """Tell what is in a results file, and its end state."""
    from wearsim.cli.summary import end_state
    from wearsim.results import open_results

    result = open_results(file)
    if json:
        write_json(_data(result))
        return
    write_table(result.title, _contents(result))
    write_table("end state" if result.finished else "state so far", end_state(result))
    for text in result.notes:
        note(f"note: {text}")
    for text in result.warnings:
        note(f"warning: {text}")


def _contents(result: Result) -> list[tuple[str, str]]:
    from wearsim.cli.summary import effort, standing
    from wearsim.report.units import count

    raw = result.raw
    records = f"{len(result.record_passes)}, at passes {count(float(result.record_passes[0]))} to"
    plugins = (
        f"{item['kind']} {item['name']} ({item['distribution']} {item['version']})"
        for item in raw.plugins
    )
    return [
        ("test", standing(result)),
        ("scenario", raw.scenario_file),
        ("input files", ", ".join(raw.files) or "none"),
        ("contact model", result.model),
        ("stepper", f"{result.stepper}, tolerance {raw.tolerance:g}"),
        ("plugins", "\n".join(plugins)),
        ("software", ", ".join(f"{name} {number}" for name, number in raw.software.items())),
        ("seed", str(raw.seed)),
        ("written", raw.created),
        ("records", f"{records} {count(float(result.record_passes[-1]))}"),
        ("strips", str(len(result.y))),
        *effort(result),
    ]


def _data(result: Result) -> dict[str, Any]:
    from wearsim.cli.summary import as_json

    raw = result.raw
    return {
        **as_json(result),
        "total_passes": raw.total_passes,
        "scenario_file": raw.scenario_file,
        "scenario_sha256": raw.sha256,
        "scenario": raw.scenario_text,
        "files": list(raw.files),
        "plugins": raw.plugins,
        "software": raw.software,
        "seed": raw.seed,
        "tolerance": raw.tolerance,
        "created": raw.created,
        "record_passes": result.record_passes,
    }
