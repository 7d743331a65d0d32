"""The implicit stepper: backward Euler by contact with wear compliance."""

from __future__ import annotations

from wearsim.evolution.error_control.error_estimates import Step
from wearsim.evolution.error_control.step_doubling import StepDoublingStepper
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import implicit_step


class ImplicitStepper(StepDoublingStepper):
    """Solves the contacts on the profiles at the end of each step, for models that can.

    Stable whatever the step, and of first order: the twin has about twice the error of the test, so
    that the two lie apart by that of the test.
    """

    order = 1

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the implicit step."""
        return implicit_step
