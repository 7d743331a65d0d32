"""Which stepper a scenario runs with, and whether its contact model can take what is asked."""

from __future__ import annotations

from wearsim.errors import CapabilityError, Mistake, ScenarioError
from wearsim.evolution.error_control.step_size import StepControl
from wearsim.evolution.steppers.backward_euler import ImplicitStepper
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.forward_euler import ExplicitStepper
from wearsim.evolution.steppers.per_pass import PerPassStepper
from wearsim.evolution.steppers.rkl2 import StabilisedStepper
from wearsim.plugins import ContactModel
from wearsim.scenario import Scenario


def check_model(scenario: Scenario, model: ContactModel) -> None:
    """Raise CapabilityError if the contact model cannot take what the scenario asks of it."""
    needs = {
        "bearing_torque": ("creepage.drive = 'free'", scenario.creepage.drive == "free"),
        "creepage_variation": (
            "creepage.differential_slip = true",
            scenario.creepage.differential_slip,
        ),
    }
    for capability, (asked, needed) in needs.items():
        if needed and not getattr(model.capabilities, capability):
            raise CapabilityError(
                f"{scenario.file}: contact model '{scenario.contact.model}' cannot take {asked};"
                " choose another contact.model"
            )


def chosen_stepper(scenario: Scenario, model: ContactModel, contacts: int) -> str:
    """Return the stepper a scenario asks for, or for "auto" the one that fits the contact model.

    Raises
    ------
    CapabilityError
        If implicit steps are asked of a model that cannot take them.
    """
    able = model.capabilities.wear_compliance and (contacts == 1 or model.capabilities.coupled)
    asked = scenario.evolution.stepper
    if asked == "auto":
        return "implicit" if able else "stabilised"
    if asked == "implicit" and not able:
        raise CapabilityError(
            f"{scenario.file}: contact model '{scenario.contact.model}' takes no wear compliance"
            + (
                " of several contacts that wear one body"
                if model.capabilities.wear_compliance
                else ""
            )
            + "; set evolution.stepper = 'stabilised' or 'per-pass', or choose another"
            " contact.model"
        )
    return asked


def build_stepper(scenario: Scenario, name: str) -> Stepper:
    """Return the stepper called `name` with the scenario's tolerance and step."""
    evolution = scenario.evolution
    idle = {
        "step": name == "per-pass" and evolution.step is not None,
        "allow_unstable": name != "explicit" and evolution.allow_unstable,
    }
    problems = [
        Mistake("evolution", key, f'has no meaning with stepper = "{name}"')
        for key, told in idle.items()
        if told
    ]
    if problems:
        raise ScenarioError(scenario.file, problems)
    control = StepControl(evolution.tolerance)
    forced = float(evolution.step) if evolution.step is not None else None
    if name == "implicit":
        return ImplicitStepper(control, forced)
    if name == "stabilised":
        return StabilisedStepper(control, forced)
    if name == "explicit":
        return ExplicitStepper(control, forced, evolution.allow_unstable)
    return PerPassStepper()
