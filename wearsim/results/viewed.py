"""Results as figures, in notebooks and as tables of pandas, by the view of their kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.errors import PluginError
from wearsim.plugins import StudyKind, registry
from wearsim.report.frames import as_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


def study_kinds() -> list[StudyKind]:
    """Return all installed kinds of studies."""
    return [
        item.spec
        for item in registry().all()
        if item.refusal is None and isinstance(item.spec, StudyKind)
    ]


def kind_of_result(result: Any) -> StudyKind:
    """Return the kind of study of a result.

    Raises
    ------
    PluginError
        If no installed plugin registers it.
    """
    kinds = {kind.result: kind for kind in study_kinds()}
    for item in type(result).__mro__:
        if kind := kinds.get(f"{item.__module__}:{item.__qualname__}"):
            return kind
    raise PluginError(
        f"{type(result).__name__} of {type(result).__module__} is the result of no kind of study"
        " that is installed; install its plugin again"
    )


class Viewed:
    """A result that shows its view: in figures, notebooks and tables of pandas."""

    @property
    def view(self) -> Any:
        """What the result shows: rows, JSON, panels, tables and columns; a `View` of its kind."""
        return kind_of_result(self).load("view")(self)

    def plot(self, ax: Axes | None = None) -> Any:
        """Draw the result.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            For one panel: the worn profiles of a run, the depth of an ensemble against the roller
            passes, the density of the dissipated power. By default a figure with all panels.

        Returns
        -------
        Axes or Figure
            A notebook shows the figure; ``savefig("rig.png")`` writes it.

        Raises
        ------
        TypeError
            If `ax` is something else, as an array of axes or a figure.

        Examples
        --------
        >>> result = wearsim.run("rig.toml")
        >>> result.plot().savefig("rig.png")
        >>> from matplotlib.figure import Figure
        >>> result.plot(ax=Figure().subplots()).get_xlabel()
        'y [mm]'
        """
        from matplotlib.axes import Axes  # noqa: PLC0415  (slow to import)

        from wearsim.report.figures import draw, figure_of  # noqa: PLC0415

        sheet = self.view.panels()
        if ax is None:
            return figure_of(sheet)
        if not isinstance(ax, Axes):
            raise TypeError(f"ax must be one Axes of matplotlib, got a {type(ax).__name__}")
        draw(ax, sheet.first)
        return ax

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the result as a table of pandas.

        Returns
        -------
        pandas.DataFrame
            In SI; ``attrs["units"]`` has the unit of each column. Of a run one row for each step,
            of realisations one for each that is completed, of a contact one for each strip, of a
            cam one for each station, of an identification one for each groove. Values of several
            rollers are in columns "normal_force.1", "normal_force.2".

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed, which is part of the extra ``wearsim[data]``.

        Examples
        --------
        >>> table = wearsim.run("rig.toml").to_dataframe()
        >>> table.attrs["units"]["depth"], bool(table["depth"].is_monotonic_increasing)
        ('m', True)
        """
        return as_frame(*self.view.frame())

    def _repr_html_(self) -> str:
        from wearsim.report.notebook import view_html  # noqa: PLC0415  (imports matplotlib)

        return view_html(self.view)
