"""Figure of a result of any kind."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.figures.cam_run import cam_run_figure
from wearsim.report.figures.contact import dissipation_figure, draw_density
from wearsim.report.figures.ensemble import draw_course, ensemble_figure
from wearsim.report.figures.identification import draw_factors, identification_figure
from wearsim.report.figures.life import draw_survival, life_figure
from wearsim.report.figures.run import draw_worn_profiles, run_figure
from wearsim.report.measured import Measured
from wearsim.results import DissipationResult, EnsembleResult, IdentificationResult, Result
from wearsim.results.ensemble.life import LifeResult


def figure_of(
    result: Result | DissipationResult | EnsembleResult | IdentificationResult,
    measured: Sequence[Measured] = (),
) -> Figure:
    """Return the figure of a result.

    Parameters
    ----------
    result : Result, DissipationResult, EnsembleResult or IdentificationResult
    measured : sequence of Measured
        Profiles drawn over those of a run or an ensemble.
    """
    if isinstance(result, LifeResult):
        return life_figure([result], [result.title])
    if isinstance(result, EnsembleResult):
        return ensemble_figure(result, measured)
    if isinstance(result, DissipationResult):
        return dissipation_figure(result)
    if isinstance(result, IdentificationResult):
        return identification_figure(result)
    if "station_angle" in result.raw.static:
        return cam_run_figure(result, tuple(measured))
    return run_figure(result, measured)


def plot(
    result: Result | DissipationResult | EnsembleResult | IdentificationResult,
    axes: Axes | None = None,
) -> Axes | Figure:
    """Draw one panel of the figure of a result on axes, or return the whole figure.

    Parameters
    ----------
    result : Result, DissipationResult, EnsembleResult or IdentificationResult
    axes : Axes, optional

    Raises
    ------
    TypeError
        If `axes` is something else, as an array of axes or a figure.
    """
    if axes is None:
        return figure_of(result)
    if not isinstance(axes, Axes):
        raise TypeError(f"ax must be one Axes of matplotlib, got a {type(axes).__name__}")
    if isinstance(result, LifeResult):
        draw_survival(axes, [result], [result.title])
    elif isinstance(result, EnsembleResult):
        draw_course(axes, result)
    elif isinstance(result, DissipationResult):
        draw_density(axes, result)
    elif isinstance(result, IdentificationResult):
        draw_factors(axes, result)
    else:
        draw_worn_profiles(axes, result)
    return axes
