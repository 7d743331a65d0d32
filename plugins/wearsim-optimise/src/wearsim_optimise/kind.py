"""Hooks: the optimisation as a kind of study, and the table `[optimise]` of a scenario."""

from __future__ import annotations

from collections.abc import Iterable

from wearsim.plugins import Field, Options, StudyKind, TableSpec, hookimpl


class OptimiseTable(Options):
    """What `wearsim optimise` varies and looks for; options of the verb replace the keys."""

    vary: tuple[str, ...] = Field(
        default=(), description="Variables: 'cam.base_radius=35mm:60mm', 'KEY=A,B,C' for a list."
    )
    maximise: tuple[str, ...] = Field(default=(), description="Names of quantities: 'life.b10'.")
    minimise: tuple[str, ...] = Field(default=(), description="Names of quantities.")
    subject_to: tuple[str, ...] = Field(
        default=(), description="Constraints: 'peak_pressure < 900 MPa'."
    )
    then: str = Field(
        default="", description="Quantity that is least among designs within 1 % of the best."
    )
    tolerance: tuple[str, ...] = Field(
        default=(), description="Tolerances of the drawing: 'cam.base_radius=0.05mm'."
    )
    realisations: int = Field(default=40, ge=1, description="Realisations of lives and ensembles.")
    evaluations: int | None = Field(default=None, ge=3, description="Most designs of the search.")
    starts: int = Field(default=3, ge=1, description="Starts of the search.")


@hookimpl
def wearsim_study_kinds() -> Iterable[StudyKind]:
    """Yield the kind of study that `wearsim optimise` computes."""
    yield StudyKind(
        "optimisation",
        summary="best values of design variables",
        result="wearsim_optimise.result:OptimisationResult",
        view="wearsim_optimise.view:OptimisationView",
        data="wearsim_optimise.result:OptimisationData",
        format="wearsim-optimisation",
        holds="designs of an optimisation, from `wearsim optimise`",
        resume="wearsim_optimise.api:resume_optimise",
        protocol=2,
    )


@hookimpl
def wearsim_tables() -> Iterable[TableSpec]:
    """Yield the table `[optimise]`."""
    summary = "What `wearsim optimise` varies and looks for."
    yield TableSpec("optimise", OptimiseTable, summary, protocol=2)
