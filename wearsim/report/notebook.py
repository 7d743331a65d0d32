"""Scenarios and results as notebooks show them: a short table and a small figure."""

from __future__ import annotations

import base64
import io
import tomllib
from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.report.summary import Rows, end_state, estimates, standing
from wearsim.report.text import count, shown
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.results.ensemble.life import LifeResult
from wearsim.scenario import Scenario
from wearsim.scenario.parse.toml import flat

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CELL = "text-align: left; padding: 0.1em 0.8em 0.1em 0; vertical-align: top"
_SHARES = (1.0, 10.0, 50.0)  # failed specimens [%]
_LONGEST = 60  # characters of a value


def result_html(result: Result | DissipationResult | EnsembleResult) -> str:
    """Return a result as HTML: its answers with their errors, and one panel of its figure.

    Parameters
    ----------
    result : Result, DissipationResult or EnsembleResult
    """
    # by name, since figures import matplotlib
    from wearsim.report.figures.result import plot  # noqa: PLC0415

    rows = _rows(result)
    empty = isinstance(result, DissipationResult | EnsembleResult) and result.count == 0
    figure = "" if empty else _figure(lambda axes: plot(result, axes), f"{rows[0][0]}, drawn")
    return _page(result.title, rows, figure)


def scenario_html(scenario: Scenario) -> str:
    """Return a scenario as HTML: its keys, and the unworn bodies or the path of the roller.

    Parameters
    ----------
    scenario : Scenario
    """
    given = dict(flat(tomllib.loads(scenario.text)))
    random = {key: item.describe() for item in scenario.random for key in item.keys}
    inner = {key for key in given for name in random if key.startswith(f"{name}.")}
    rows = [(key, _value(value)) for key, value in given.items() if key not in inner]
    rows = [(key, random.get(key, text)) for key, text in rows if key != "title"]
    rows += [(key, text) for key, text in random.items() if key not in given]
    figure = ""
    if scenario.cam is None:
        alt = "heights of cylinder and roller across the track before wear"
        figure = _figure(lambda axes: _draw_bodies(axes, scenario), alt)
    return _page(scenario.title, rows, figure)


def _rows(result: Result | DissipationResult | EnsembleResult) -> Rows:
    if isinstance(result, Result):
        return [("test", standing(result)), *end_state(result)]
    done = [("realisations", f"{count(result.count)} of {count(result.raw.requested)}")]
    if isinstance(result, DissipationResult):
        power = result.summaries["power"]
        error = shown(power.mean_interval.half_width, "W", 2)
        return [*done, ("mean dissipated power", f"{shown(power.mean, 'W')} ± {error}")]
    if isinstance(result, LifeResult):
        return [
            *done,
            *((f"B{share:g}", _life(result, share)) for share in _SHARES if result.count),
        ]
    return [*done, *estimates(result)]


def _life(result: LifeResult, share: float) -> str:
    found = result.b(share)
    return f"{found.value:.3g} {result.unit} [{found.low:.3g}, {found.high:.3g}]"


def _value(value: object) -> str:
    """Return a value of a scenario on one line."""
    if isinstance(value, Mapping):
        return " ".join(map(_value, value.values()))
    if isinstance(value, list):
        text = "; ".join(map(_value, value))
        return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    return str(value).lower() if isinstance(value, bool) else str(value)


def _draw_bodies(axes: Axes, scenario: Scenario) -> None:
    """Draw the surfaces of cylinder and roller across the track before wear."""
    crown, width = scenario.roller.crown_radius, scenario.roller.width
    profile = scenario.cylinder.profile
    half = np.sqrt(2.0 * crown * 50e-6)  # where the crown is 50 um away
    half = min(half, 0.5 * width) if width else half
    y = np.linspace(-half, half, 201)
    ground = np.zeros_like(y) if profile is None else np.interp(y, profile.y, profile.height)
    axes.plot(1e3 * y, 1e6 * y**2 / (2.0 * crown), color="#0072b2", label="roller")
    axes.plot(1e3 * y, 1e6 * ground, color="#b35900", label="cylinder")
    axes.set(title="Bodies before wear", xlabel="y [mm]", ylabel="height [um]")
    axes.legend(frameon=False)


def _figure(draw: Callable[[Axes], Any], alt: str) -> str:
    """Return a panel as an image."""
    from wearsim.report.parts import titled_figure  # noqa: PLC0415

    content = io.BytesIO()
    with titled_figure(5.2, 3.1) as figure:  # as wide as the longest title
        draw(figure.subplots())
        figure.savefig(content, format="png", dpi=100)
    data = base64.b64encode(content.getvalue()).decode()
    return f'<img alt="{escape(alt)}" src="data:image/png;base64,{data}">'


def _page(title: str, rows: Rows, figure: str) -> str:
    cells = "".join(
        f'<tr><th scope="row" style="{_CELL}">{escape(name)}</th>'
        f'<td style="{_CELL}">{escape(text)}</td></tr>'
        for name, text in rows
    )
    return (
        '<div style="display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start">'
        f'<table><caption style="text-align: left"><b>{escape(title)}</b></caption>'
        f"<tbody>{cells}</tbody></table>{figure}</div>"
    )
