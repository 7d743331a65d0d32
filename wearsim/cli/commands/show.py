"""`wearsim show`: content of a results file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.shared import Json, ResultsFile, open_any, write_json, write_notes, write_table

if TYPE_CHECKING:
    from wearsim.results.content import StudyData


def show(file: ResultsFile, json: Json = False) -> None:
    """Show the content of a results file and the end state."""
    from wearsim.cli.render import ensemble_table, summary
    from wearsim.report.text import count
    from wearsim.results import DissipationResult, EnsembleResult

    result = open_any(file)
    if json:
        data: dict[str, Any]
        if isinstance(result, DissipationResult):
            data = summary.dissipation_json(result)
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
        summary.write_spread(result, _sources(result.raw))
    elif isinstance(result, EnsembleResult):
        groups = [(f"random {item['name']}", item["text"]) for item in result.raw.groups]
        ensemble_table.write_ensemble(result, [*groups, *_sources(result.raw)])
    else:
        first, last = (count(float(result.record_passes[place])) for place in (0, -1))
        rows = [
            ("test", summary.standing(result)),
            ("contact model", result.described_model),
            ("stepper", f"{result.stepper}, tolerance {result.raw.tolerance:g}"),
            ("seed", str(result.raw.seed)),
            *summary.draws(result),
            ("records", f"{len(result.record_passes)}, at passes {first} to {last}"),
            ("strips", str(len(result.y))),
            *summary.effort(result),
        ]
        write_table(result.title, [*rows, *_sources(result.raw)])
        title = "end state" if result.finished else "current state"
        write_table(title, summary.end_state(result))
    write_notes(result.notes, result.warnings)
    if isinstance(result, EnsembleResult):
        ensemble_table.warn_of_failures(result)


def _sources(raw: StudyData) -> list[tuple[str, str]]:
    """Return rows on scenario, input files, plugins and software of a study."""
    plugins = [
        f"{item['kind']} {item['name']} ({item['distribution']} {item['version']})"
        for item in raw.plugins
    ]
    return [
        ("scenario", raw.scenario_file),
        ("input files", ", ".join(raw.files) or "none"),
        ("plugins", "\n".join(plugins)),
        ("software", ", ".join(f"{name} {number}" for name, number in raw.software.items())),
        ("written", raw.created),
    ]


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
