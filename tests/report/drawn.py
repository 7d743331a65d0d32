"""Figures of results, drawn with matplotlib from their panels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
from matplotlib.figure import Figure

from wearsim.levelling import Measured
from wearsim.report.figures import figure_of
from wearsim.report.page import page as pages, plots
from wearsim.studies.comparison.compare import Comparison
from wearsim.studies.comparison.view import comparison_sheet
from wearsim.studies.opening import views_of


def run_figure(result: Any, measured: Sequence[Measured] = ()) -> Figure:
    """Return the figure of a result."""
    return figure_of(result.view.panels(measured))


ensemble_figure = dissipation_figure = identification_figure = run_figure


def contact_figure(study: Any, title: str) -> Figure:
    """Return the figure of a contact with a title."""
    return figure_of(replace(study, title=title).view.panels())


def cam_figure(study: Any, title: str) -> Figure:
    """Return the figure of a cam with a title."""
    return figure_of(replace(study.view.panels(), title=title))


def comparison_figure(comparison: Comparison, title: str = "") -> Figure:
    """Return the figure of a comparison with a title."""
    return figure_of(comparison_sheet(comparison, title))


def page_of(results: Sequence[Any], measured: Sequence[Measured] = ()) -> str:
    """Return the page on results."""
    return pages.page_of(views_of(results), measured)


def texts_of(results: Sequence[Any]) -> str:
    """Return the page on results without its figures, which take most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots, "panels_of", lambda sheet: ({}, []))
        return page_of(results)


def plots_of(result: Any, measured: Sequence[Measured] = ()) -> dict[str, Any]:
    """Return the figures of a page on a result by their titles."""
    panels, _ = plots.panels_of(result.view.panels(measured))
    return {panel.title: plots.draw(panel) for panel in panels.values()}
