"""Views of results, and their displays.

The names in `__all__` are public: panels as data, and their figures on pages. They are imported at
their first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.report.page.live import LiveFigure, Recording, record
    from wearsim.report.page.page import page_style
    from wearsim.report.page.plots import panels_of
    from wearsim.report.panels import Axis, Line, Panel, Records, Sheet, Text

_MODULES = {
    "LiveFigure": "page.live",
    "Recording": "page.live",
    "record": "page.live",
    "page_style": "page.page",
    "panels_of": "page.plots",
    **dict.fromkeys(("Axis", "Line", "Panel", "Records", "Sheet", "Text"), "panels"),
}

__all__ = [
    "Axis",
    "Line",
    "LiveFigure",
    "Panel",
    "Recording",
    "Records",
    "Sheet",
    "Text",
    "page_style",
    "panels_of",
    "record",
]


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module 'wearsim.report' has no attribute '{name}'")
    return getattr(import_module(f"wearsim.report.{_MODULES[name]}"), name)
