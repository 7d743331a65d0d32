"""The kind of study `winkler-approach`: by how much the bodies approach under several loads."""

import numpy as np

from wearsim.report.panels import Axis, Line, Panel, Sheet
from wearsim.report.view import Frame, Row, View
from wearsim.results.viewed import Viewed
from wearsim.types import Creepage, OperatingPoint


class Approach(Viewed):
    """Approach [m] of rolling bodies with a gap [m] under forces [N]; shown by `ApproachView`."""

    def __init__(self, model, forces, gap, longitudinal_curvature):
        points = [OperatingPoint(force, 1.0, Creepage(1e-3), 0.1) for force in forces]
        solved = [model.solve_one(gap, longitudinal_curvature, point) for point in points]
        self.force = np.asarray(forces)
        self.approach = np.array([solution.approach for solution in solved])


class ApproachView(View):
    """What the shell, pages, notebooks, JSON and pandas show of an `Approach`."""

    title, question = "elastic foundation", "How far do the bodies approach?"

    def __init__(self, result):
        self.result = result

    def rows(self):
        """Return the answers with their units, the most important first."""
        return [Row("greatest approach", self.result.approach.max(), "um")]

    def data(self):
        """Return all numbers for JSON, in SI units."""
        return {"force_N": self.result.force, "approach_m": self.result.approach}

    def panels(self, measured=()):
        """Return what figures and pages draw."""
        curve = Line(self.result.force, self.result.approach, marker="o")
        axes = Axis("normal force", "N"), Axis("approach", "um")
        panel = Panel("Approach", *axes, [curve], "Approach of the bodies by normal force.")
        return Sheet(self.title, {"approach": panel}, [["approach"]], (5.0, 3.0))

    def frame(self):
        """Return the columns of a table of pandas."""
        columns = [("force", "N", self.result.force), ("approach", "m", self.result.approach)]
        return Frame(columns, "load", range(1, len(self.result.force) + 1))
