"""The kinds of studies of wearsim, registered through the hook that plugins use."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from wearsim.plugins import StudyKind, hookimpl

_TESTS = "wearsim.studies.comparison.view:comparison_view"  # runs and ensembles
_ENSEMBLE = "wearsim-ensemble"


@hookimpl
def wearsim_study_kinds() -> Iterable[StudyKind]:
    """Yield the kinds of studies."""
    return (
        StudyKind(
            "run",
            summary="one wear test",
            result="wearsim.studies.run.result:Result",
            view="wearsim.studies.kinds:view_of_run",
            data="wearsim.studies.run.result:RunData",
            format="wearsim-run",
            holds="a wear test, from `wearsim run`",
            resume="wearsim.studies.run.run:resume",
            compare=_TESTS,
            protocol=2,
        ),
        StudyKind(
            "contact",
            summary="one contact",
            result="wearsim.studies.contact.single:ContactStudy",
            view="wearsim.studies.contact.view:ContactView",
            protocol=2,
        ),
        StudyKind(
            "cam",
            summary="a cam along its angle, before wear",
            result="wearsim.studies.cam.study:CamStudy",
            view="wearsim.studies.cam.view:CamView",
            protocol=2,
        ),
        StudyKind(
            "dissipation",
            summary="one contact for many realisations of its random inputs",
            result="wearsim.studies.dissipation.result:DissipationResult",
            view="wearsim.studies.dissipation.view:DissipationView",
            data="wearsim.studies.dissipation.result:DissipationData",
            format="wearsim-dissipation",
            holds="realisations of one contact, from `wearsim dissipation`",
            protocol=2,
        ),
        StudyKind(
            "ensemble",
            summary="many wear tests",
            result="wearsim.studies.ensemble.result:EnsembleResult",
            view="wearsim.studies.ensemble.view:EnsembleView",
            data="wearsim.studies.ensemble.file.data:EnsembleData",
            format=_ENSEMBLE,
            read="wearsim.studies.ensemble.file.parts:read_ensemble",
            holds="an ensemble of wear tests, from `wearsim ensemble`",
            resume="wearsim.studies.ensemble.api:resume_ensemble",
            compare=_TESTS,
            protocol=2,
        ),
        StudyKind(
            "life",
            summary="tests that end at limits of wear",
            result="wearsim.studies.life.result:LifeResult",
            view="wearsim.studies.life.view:LifeView",
            data="wearsim.studies.ensemble.file.data:EnsembleData",
            format=_ENSEMBLE,
            read="wearsim.studies.ensemble.file.parts:read_ensemble",
            marked_by="life",
            holds="lives, from `wearsim life`",
            resume="wearsim.studies.ensemble.api:resume_ensemble",
            compare="wearsim.studies.life.comparison_view:LivesView",
            protocol=2,
        ),
        StudyKind(
            "returns",
            summary="lives of designs after returns from the field",
            result="wearsim.studies.returns.result:FieldReturns",
            view="wearsim.studies.returns.view:FieldReturnsView",
            protocol=2,
        ),
        StudyKind(
            "demonstration",
            summary="tests that demonstrate the life of a design",
            result="wearsim.studies.demonstration.result:Demonstration",
            view="wearsim.studies.demonstration.view:DemonstrationView",
            protocol=2,
        ),
        StudyKind(
            "identification",
            summary="wear factors of measured grooves",
            result="wearsim.studies.identify.result:IdentificationResult",
            view="wearsim.studies.identify.view:IdentificationView",
            data="wearsim.studies.identify.result:IdentificationData",
            format="wearsim-identification",
            holds="wear factors of measured grooves, from `wearsim identify`",
            protocol=2,
        ),
        StudyKind(
            "comparison",
            summary="runs and ensembles at the ends of their tests",
            result="wearsim.studies.comparison.compare:Comparison",
            view="wearsim.studies.comparison.view:ComparisonView",
            protocol=2,
        ),
    )


def view_of_run(result: Any) -> Any:
    """Return the view of the run of a cylinder, or of a cam."""
    if result.is_cam:
        from wearsim.studies.cam.run_view import CamRunView  # noqa: PLC0415  (when it is shown)

        return CamRunView(result)
    from wearsim.studies.run.view import RunView  # noqa: PLC0415  (when it is shown)

    return RunView(result)
