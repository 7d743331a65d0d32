"""The reproduction as a kind of study, which figures, notebooks and tables of pandas show."""

from __future__ import annotations

from collections.abc import Iterable

from wearsim.plugins import StudyKind, hookimpl


@hookimpl
def wearsim_study_kinds() -> Iterable[StudyKind]:
    """Yield the kind of study that `wearsim reproduce` computes."""
    yield StudyKind(
        "reproduction",
        summary="numbers of Chevalier et al., Wear 258 (2005), printed and computed",
        result="wearsim_chevalier2005.study:Reproduction",
        view="wearsim_chevalier2005.view:ReproductionView",
        protocol=2,
    )
