"""What `wearsim life` does with lives: returns, demonstration tests, page and table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import wearsim
from wearsim.cli.render import write_table_file
from wearsim.cli.shared import check_ending, checking, refuse

if TYPE_CHECKING:
    from wearsim.report.view import View
    from wearsim.scenario import Scenario
    from wearsim.studies.life.result import LifeResult
    from wearsim.studies.life.stored_settings import LifeSettings


@dataclass(frozen=True)
class LifeUse:
    """Options of `wearsim life` that use lives: returns, demonstration tests, page and table.

    Parameters
    ----------
    returns : Path, optional
        File of --returns.
    life_factor : float, optional
    demonstrate : str, optional
        Requirement of --demonstrate.
    page, table : Path, optional
        Files to be written.
    """

    returns: Path | None
    life_factor: float | None
    demonstrate: str | None
    page: Path | None
    table: Path | None

    @property
    def is_special(self) -> bool:
        """Whether returns or demonstration tests are shown instead of the lives."""
        return self.returns is not None or self.demonstrate is not None

    def check(self, force: bool) -> None:
        """Check the options and the names of the files."""
        returns, demonstrate = self.returns is not None, self.demonstrate is not None
        refuse(returns and demonstrate, "goes without --returns", "--demonstrate")
        refuse(self.life_factor is not None and not returns, "goes with --returns", "--life-factor")
        refuse(
            self.table is not None and not self.is_special,
            "goes with --returns or --demonstrate",
            "--table",
        )
        check_ending(self.page, force, "--page", (".html",), "format of a page")
        check_ending(self.table, force, "--table", (".csv",), "format of a table")

    def check_studies(
        self, labels: Sequence[str], studies: Sequence[tuple[Scenario, LifeSettings]]
    ) -> None:
        """Check before any test that the lives of studies can be used."""
        if self.demonstrate is not None:
            from wearsim.studies.demonstration.result import Requirement

            with checking("--demonstrate"):
                Requirement.parse(self.demonstrate, studies[0][1].unit)
        if self.returns is None:
            return
        from wearsim.studies.returns.result import NO_LEVELS
        from wearsim.studies.returns.table import UnitsOf, read_returns
        from wearsim.uq.distributions.two_levels import TwoLevels

        units = []
        for label, (scenario, settings) in zip(labels, studies, strict=True):
            laws = {item.name: item.distribution for item in scenario.random}
            refuse(
                not isinstance(laws.get(settings.factor), TwoLevels),
                f"{NO_LEVELS}: give --posterior",
                "--returns",
            )
            units.append(UnitsOf(label, settings.unit, settings.rate, tuple(scenario.limit.given)))
        read_returns(self.returns, units)

    def view_of(self, results: Sequence[LifeResult], labels: Sequence[str]) -> View:
        """Return the view of lives after returns, or of demonstration tests."""
        view: View
        if self.demonstrate is not None:
            with checking("--demonstrate"):
                view = wearsim.demonstration(results, self.demonstrate, labels=labels).view
        else:
            assert self.returns is not None
            given = {} if self.life_factor is None else {"life_factor": self.life_factor}
            with checking("--returns"):
                view = wearsim.field_returns(results, self.returns, labels=labels, **given).view
        return view

    def write(self, views: Sequence[View]) -> dict[str, Path | None]:
        """Write page and table, and return their names."""
        if self.page is not None:
            from wearsim.report.page.page import save_page

            save_page(views, self.page)
        if self.table is not None:
            (columns,) = views[0].columns().values()
            write_table_file(columns, self.table)
        return {"page": self.page, "table": self.table}
