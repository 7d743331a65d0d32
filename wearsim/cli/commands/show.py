"""`wearsim show`: what is in a results file, and its end state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.arguments import Json, ResultsFile
from wearsim.cli.output import tell_notes, write_json, write_table

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, EnsembleResult, Result
    from wearsim.results.content import StudyData


def show(file: ResultsFile, json: Json = False) -> None:
    """Tell what is in a results file, and its end state."""
    from wearsim.cli.render.summary import end_state
    from wearsim.results import kind_of, open_dissipation, open_ensemble, open_results

    kind = kind_of(file)
    if kind == "dissipation":
        _show_study(open_dissipation(file), json)
        return
    if kind == "ensemble":
        _show_ensemble(open_ensemble(file), json)
        return
    result = open_results(file)
    if json:
        write_json(_data(result))
        return
    write_table(result.title, _contents(result))
    write_table("end state" if result.finished else "state so far", end_state(result))
    tell_notes(result)


def _show_study(result: DissipationResult, json: bool) -> None:
    from wearsim.cli.render.dissipation_table import as_json, write_spread

    raw = result.raw
    if json:
        write_json({**as_json(result), **_origin(raw)})
        return
    write_spread(result, _sources(raw))
    tell_notes(result)


def _show_ensemble(result: EnsembleResult, json: bool) -> None:
    from wearsim.cli.commands.ensemble import tell_failures
    from wearsim.cli.render.ensemble_table import as_json, write_ensemble

    raw = result.raw
    if json:
        write_json({**as_json(result), **_origin(raw)})
        return
    groups = [(f"random {item['name']}", item["text"]) for item in raw.groups]
    write_ensemble(result, [*groups, *_sources(raw)])
    tell_notes(result)
    tell_failures(result)


def _sources(raw: StudyData) -> list[tuple[str, str]]:
    """Return what the realisations of a study were made from, and with what."""
    return [
        ("scenario", raw.scenario_file),
        ("input files", ", ".join(raw.files) or "none"),
        ("plugins", "\n".join(_plugins(raw))),
        ("software", ", ".join(f"{name} {number}" for name, number in raw.software.items())),
        ("written", raw.created),
    ]


def _plugins(raw: StudyData) -> list[str]:
    return [
        f"{item['kind']} {item['name']} ({item['distribution']} {item['version']})"
        for item in raw.plugins
    ]


def _origin(raw: StudyData) -> dict[str, Any]:
    """Return what a file was made from, and with what."""
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


def _contents(result: Result) -> list[tuple[str, str]]:
    from wearsim.cli.render.summary import draws, effort, standing
    from wearsim.report.text.units import count

    raw = result.raw
    records = f"{len(result.record_passes)}, at passes {count(float(result.record_passes[0]))} to"
    return [
        ("test", standing(result)),
        ("scenario", raw.scenario_file),
        ("input files", ", ".join(raw.files) or "none"),
        ("contact model", result.described_model),
        ("stepper", f"{result.stepper}, tolerance {raw.tolerance:g}"),
        ("plugins", "\n".join(_plugins(raw))),
        ("software", ", ".join(f"{name} {number}" for name, number in raw.software.items())),
        ("seed", str(raw.seed)),
        *draws(result),
        ("written", raw.created),
        ("records", f"{records} {count(float(result.record_passes[-1]))}"),
        ("strips", str(len(result.y))),
        *effort(result),
    ]


def _data(result: Result) -> dict[str, Any]:
    from wearsim.cli.render.summary import as_json

    raw = result.raw
    return {
        **as_json(result),
        "total_passes": raw.total_passes,
        **_origin(raw),
        "tolerance": raw.tolerance,
        "record_passes": result.record_passes,
    }
