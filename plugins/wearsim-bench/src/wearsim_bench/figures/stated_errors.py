"""Figure of stated against true errors."""

from __future__ import annotations

from matplotlib.figure import Figure

from wearsim.report.figures import figure_style, name_axes
from wearsim.report.panels import BLUE, GREEN, GREY, ORANGE
from wearsim_bench.figures.lines import set_log_axis
from wearsim_bench.measure.measurement import Topic
from wearsim_bench.stated_errors.study import QUANTITIES, SMALL, STATED, TESTS, coverage

_SIZE = 10.5, 4.6  # in
_LOWEST = 1e-8  # smaller errors are drawn at this value


def stated_errors_figure(topic: Topic, under: str) -> Figure:
    """Return a figure of stated against true errors, with a panel for each quantity.

    Parameters
    ----------
    topic : Topic
        Topic with the measurements of single tests.
    under : str
        Text under the title.
    """
    rows = [row for row in topic.of(TESTS) if QUANTITIES[0] in row.errors]
    tolerances = sorted({row.counts["tolerance"] for row in rows}, reverse=True)
    shown = [prefix + name for name in QUANTITIES for prefix in ("", STATED)]
    values = [max(row.errors[name], _LOWEST) for row in rows for name in shown] or [_LOWEST, 1.0]
    low, high = 100.0 * min(values) / 2.0, 100.0 * max(values) * 2.0
    with figure_style():
        figure = Figure(figsize=_SIZE, layout="constrained")
        panels = figure.subplots(1, len(QUANTITIES), sharex=True, sharey=True)
        for axes, name in zip(panels, QUANTITIES, strict=True):
            for tolerance, colour, marker in zip(
                tolerances, (BLUE, ORANGE, GREEN), "os^", strict=False
            ):
                of_tolerance = [row for row in rows if row.counts["tolerance"] == tolerance]
                true, stated = (
                    [100.0 * max(row.errors[key], _LOWEST) for row in of_tolerance]
                    for key in (name, STATED + name)
                )
                label = f"tolerance {tolerance:g}"
                axes.plot(true, stated, marker, color=colour, ms=3.5, alpha=0.7, label=label)
            axes.plot([low, high], [low, high], color="k", lw=1.0, label="stated = true")
            ten = [10.0 * low, 10.0 * high]
            axes.plot([low, high], ten, color=GREY, lw=0.8, ls="--", label="stated = 10 x true")
            axes.axvline(100.0 * SMALL, color=GREY, lw=0.6, ls=":")
            axes.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high))
            set_log_axis(axes.xaxis, lambda value: f"{value:g}")
            set_log_axis(axes.yaxis, lambda value: f"{value:g}")
            statistics = coverage(rows, name)
            title = f"{name}: {statistics.covered} of {len(rows)} covered"
            ratio = statistics.counts.get("median")
            title += f",\nmedian ratio {ratio:.2g}" if ratio is not None else ""
            name_axes(axes, title, "true error [%]", "")
        panels[0].set_ylabel("stated error [%]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        figure.suptitle(f"{topic.title}\n{under}", fontsize=10.0)
    return figure
