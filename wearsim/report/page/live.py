"""Figures of Bokeh that show one panel after the other: new data instead of a new figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from bokeh.models.annotations import ColorBar

from wearsim.report.page.plots import (
    draw,
    draw_marks,
    is_boxed,
    plain_label,
    range_ends,
    right_ends,
)
from wearsim.report.panels import Axis, Panel


@dataclass
class _Recorder:
    """Recorder of what is drawn on a figure, without the figure."""

    glyphs: list[tuple[Any, Mapping[str, Any], str]] = field(default_factory=list)
    annotations: list[Any] = field(default_factory=list)
    mappers: list[tuple[float, float]] = field(default_factory=list)

    def __getattr__(self, kind: str) -> Any:
        return partial(self._glyph, kind)

    def _glyph(self, kind: str, *_: str, source: Any, legend_label: str = "", **style: Any) -> None:
        if mapper := style.pop("color_mapper", None):
            self.mappers.append((mapper.low, mapper.high))
        look = tuple(sorted((name, repr(value)) for name, value in style.items()))
        self.glyphs.append(
            ((kind, look, bool(legend_label), _is_plain(source)), source, legend_label)
        )

    def contour(self, *_: Any, **__: Any) -> None:
        """Record contours, whose areas are no columns: such a panel is drawn again."""
        self.glyphs.append((object(), {}, ""))

    def add_layout(self, item: Any, place: str = "center") -> None:
        if not isinstance(item, ColorBar):
            self.annotations.append(
                (type(item), item.properties_with_values(include_defaults=False))
            )


@dataclass(frozen=True)
class Recording:
    """What a panel draws: columns of its glyphs, annotations, and ends of its colour scales.

    Parameters
    ----------
    looks : tuple
        Kind and style of each glyph and annotation, and kind of each axis.
    columns : list of mapping of str to ndarray
        Data of each glyph, in the units shown.
    labels : list of str
        Label of each glyph in the legend, or an empty text.
    annotations : list of mapping of str to object
        Properties of each annotation.
    scales : list of tuple of float
        Ends of each colour scale.
    """

    looks: tuple[Any, ...]
    columns: list[Mapping[str, Any]]
    labels: list[str]
    annotations: list[Mapping[str, Any]]
    scales: list[tuple[float, float]]


def record(panel: Panel) -> Recording:
    """Return what a panel draws, without a figure.

    Parameters
    ----------
    panel : Panel
    """
    recorder = _Recorder()
    draw_marks(recorder, panel)
    looks = (
        *map(_kind, (panel.x, panel.y, panel.right or Axis())),
        panel.right is None,
        panel.equal,
        *(look for look, _, _ in recorder.glyphs),
        *(kind for kind, _ in recorder.annotations),
    )
    return Recording(
        looks,
        [columns for _, columns, _ in recorder.glyphs],
        [label for _, _, label in recorder.glyphs],
        [values for _, values in recorder.annotations],
        recorder.mappers,
    )


def _is_plain(columns: Mapping[str, Any]) -> bool:
    """Return whether all columns are arrays of one dimension in single precision."""
    return all(
        isinstance(values, np.ndarray) and values.ndim == 1 and values.dtype == np.float32
        for values in columns.values()
    )


def _kind(axis: Axis) -> tuple[Any, ...]:
    """Return what cannot be changed in an axis that has been drawn."""
    return (
        axis.log,
        tuple(end is None for end in axis.limits),
        axis.ticks is None or tuple(axis.ticks),
        tuple(axis.names or ()),
    )


class LiveFigure:
    """A figure of a page that shows panels one after the other.

    Parameters
    ----------
    panel : Panel
        The first panel.

    Attributes
    ----------
    figure : bokeh figure
    """

    def __init__(self, panel: Panel) -> None:
        self.figure = draw(panel)
        self._recording = record(panel)
        self._annotations = [
            item for item in self.figure.center if type(item) in self._recording.looks
        ]
        mappers = [renderer.glyph for renderer in self.figure.renderers]
        self._mappers = [glyph.color_mapper for glyph in mappers if hasattr(glyph, "color_mapper")]

    def show(
        self,
        panel: Panel,
        recording: Recording | None = None,
        frames: Sequence[Recording] = (),
        send: Callable[[str, Mapping[str, Any]], object] | None = None,
    ) -> bool:
        """Show another panel with the same marks; return False if its marks differ.

        Parameters
        ----------
        panel : Panel
        recording : Recording, optional
            What it draws, if that is known.
        frames : sequence of Recording
            Further states of the panel, which the columns have under the names "x@0", "x@1".
        send : callable, optional
            Takes the id of a data source and its columns, arrays of one dimension in single
            precision, where the caller brings them to the browser: Bokeh sends a message for each
            source, and one for each column.
        """
        new = recording or record(panel)
        if new.looks != self._recording.looks:
            return False
        for axis, along in ((panel.x, "x"), (panel.y, "y")):
            self._set_axis(axis, along, ends=not is_boxed(panel))
        if panel.right is not None:
            self.figure.extra_y_ranges["right"].update(**right_ends(panel, panel.right))
        states = (new.columns, *(frame.columns for frame in frames))
        for renderer, columns, *later in zip(self.figure.renderers, *states, strict=True):
            data = {**columns, **_further(columns, later)}
            if send is not None and _is_plain(columns):
                send(renderer.data_source.id, data)
            else:
                renderer.data_source.data = data
        for item, values in zip(self._annotations, new.annotations, strict=True):
            item.update(**values)
        for mapper, (low, high) in zip(self._mappers, new.scales, strict=True):
            mapper.update(low=low, high=high)
        self._set_labels(new.labels)
        self._recording = new
        return True

    def _set_axis(self, axis: Axis, along: str, *, ends: bool) -> None:
        if ends:
            getattr(self.figure, f"{along}_range").update(**range_ends(axis))
        getattr(self.figure, f"{along}axis")[0].axis_label = plain_label(axis.label)

    def _set_labels(self, labels: list[str]) -> None:
        """Change the entries of the legend whose texts have changed."""
        items = [item for legend in self.figure.legend for item in legend.items]
        texts = zip(self.figure.renderers, self._recording.labels, labels, strict=True)
        for renderer, old, new in texts:
            for item in items if old != new else ():
                if renderer in item.renderers:
                    item.label = {"value": new}


def _further(columns: Mapping[str, Any], frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the columns of further states, of those that change and have the same length."""
    return {
        f"{name}@{number}": frame[name]
        for name, values in columns.items()
        for number, frame in enumerate(frames)
        if len(frame[name]) == len(values)
        and not all(np.array_equal(other[name], values) for other in frames)
    }
