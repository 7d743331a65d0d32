"""Choice of the contact model by its estimated error: contact.model = "auto"."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from wearsim.atomic_write import DISK
from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, SolverError, WearsimError
from wearsim.evolution.contacts import unworn_contacts
from wearsim.evolution.observables import present_batch
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario import Scenario, as_scenario
from wearsim.scenario.parse.overrides import apply_overrides
from wearsim.scenario.tables.bodies import DUNDURS_LIMIT
from wearsim.scenario.tables.plugin import AUTO, AutoTable, ChosenTable, ContactChoice
from wearsim.studies.contact.comparison import INSTALL, REFERENCE, at_creepage
from wearsim.studies.contact.estimate import (
    Calibration,
    ErrorModel,
    calibration,
    indicators_of,
    preference,
)
from wearsim.studies.run.assemble import build_problem, chosen_stepper, prepared_model
from wearsim.studies.run.grid import contact_grid, wider_grid
from wearsim.studies.run.in_progress import RunInProgress
from wearsim.studies.run.recorder import Event, Stepped
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray, Grid

_INDICATING = ("slender", "hertz")  # models whose solution gives the indicators, in this order
_LEAST_LOAD = 0.01  # of the greatest in a state: others are next to a pause
_EARLY = 0.1  # of the passes, after which the second state is taken
_TOLERANCE = 1e-2  # of that test
_MOST_CONTACTS = 8  # of a test that may be solved by the exact theory


@dataclass(frozen=True, eq=False)
class _State:
    """Contacts whose errors are estimated: their strips and, for each, its indicators."""

    grid: Grid
    batch: ContactBatch
    indicators: list[FloatArray]


def with_chosen_model(scenario: Scenario | str | Path, test: bool) -> Scenario:
    """Return a scenario with the contact model that `contact.model = "auto"` takes.

    The cheapest installed model is taken whose estimated error of P_l(y) is at most
    `contact.tolerance` in every contact that is looked at: of the first roller at the start of
    the load; in a test all contacts at the start, after a tenth of the passes and at the end, with
    random inputs at their means, as stepped by `slender`. Models that cost less than `CHEAP` count
    as equally cheap, and the one with the least estimated error is taken. If none suffices, it is
    `halfspace` on its finest elements, if it is installed, with a warning. The text of the scenario
    names what was taken, so that it is kept.

    Parameters
    ----------
    scenario : Scenario or path
        Any; one that names a model, or has chosen before, is returned as it is.
    test : bool
        Whether the contacts of a wear test are looked at, instead of a single one.

    Raises
    ------
    CapabilityError
        If no installed model suffices, or a friction field is given. The exact theory is not taken
        for tests of more than eight contacts.
    ScenarioError, PluginError, TypeError
        As `as_scenario`.
    """
    scenario = as_scenario(scenario)
    if scenario.contact.model != AUTO:
        return scenario
    options = scenario.contact.options
    assert isinstance(options, AutoTable)
    table = calibration()
    if field := next((item.name for item in scenario.random if item.role == "field"), None):
        raise _refusal(scenario, f"{field} is a field, and no error is calibrated for it")
    states, where = _looked_at(scenario, test)
    reason = _coupling(scenario) or _not_calibrated(table, states)
    every = (
        []
        if reason
        else [table.scaled(indicators) for state in states for indicators in state.indicators]
    )
    known = [
        (max((model.error(scaled) for scaled in every), default=np.inf), model)
        for model in table.models
        if model.model in registry().names(ContactModelSpec)
    ]
    accepted = f"{100.0 * options.tolerance:g} %"
    for error, model in sorted(known, key=lambda item: preference(*item)):
        choice = _choice(scenario, model.model, model.options)
        if error <= options.tolerance and not _hindrance(scenario, choice, states, test):
            estimate = f"estimated error of P_l(y) {100.0 * error:.2g} %, tolerance {accepted}"
            return _with(scenario, choice, model, f"{estimate}, {where}")
    able = [
        (error, model)
        for error, model in known
        if not _hindrance(scenario, _choice(scenario, model.model, model.options), states, test)
    ]
    if not reason and able:
        least, best = min(able, key=lambda item: item[0])
        reason = f"the least estimated error is {100.0 * least:.2g} %, of '{best.label}'"
    finest = [item for item in able if item[1].model == REFERENCE][-1:]
    if not finest:
        missing = REFERENCE not in registry().names(ContactModelSpec)
        remedies = [f"install '{REFERENCE}' ({INSTALL[REFERENCE]})"] if missing else []
        if not missing:
            of_reference = _choice(scenario, REFERENCE, {})
            why = _hindrance(scenario, of_reference, states, test).partition(";")[0]
            reason += f"; the exact theory, '{REFERENCE}', is not possible: {why}"
        raise _refusal(scenario, reason, *remedies, *(["raise the tolerance"] if every else []))
    error, model = finest[0]
    error_text = (
        "cannot be estimated" if error == np.inf else f"is estimated as {100.0 * error:.2g} %"
    )
    why = f"no estimated error of P_l(y) is within {accepted} {where} ({reason})"
    return _with(
        scenario,
        _choice(scenario, model.model, model.options),
        model,
        f"exact theory on its finest elements, since {why}",
        f"contact model: the error of P_l(y) by '{model.label}' {error_text}, tolerance {accepted}",
    )


def _refusal(scenario: Scenario, reason: str, *remedies: str) -> CapabilityError:
    options = scenario.contact.options
    assert isinstance(options, AutoTable)
    return CapabilityError(
        f"{scenario.file}: contact.model = 'auto' finds no model within contact.tolerance ="
        f" {options.tolerance:g}: {reason}; {', '.join([*remedies, 'name a contact.model'])}"
    )


def _choice(scenario: Scenario, model: str, options: dict[str, object]) -> ContactChoice:
    """Return a model instead of the scenario's, or `auto` if it is not installed."""
    if model not in registry().names(ContactModelSpec):
        return scenario.contact
    chosen_options = registry().get(ContactModelSpec, model).options.model_validate(options)
    return replace(scenario.contact, model=model, options=chosen_options)


def _with(
    scenario: Scenario, choice: ContactChoice, model: ErrorModel, why: str, warning: str = ""
) -> Scenario:
    """Return a scenario with a model that has been chosen, also in its text."""
    auto = scenario.contact.options
    assert isinstance(auto, AutoTable)
    note = f"contact.model = 'auto' has taken '{model.label}': {why}"
    chosen = ChosenTable(model=model.model, options=model.options, why=note, warning=warning)
    text = apply_overrides(
        scenario.text, scenario.file, {"contact.chosen": chosen.model_dump(exclude_defaults=True)}
    )
    auto = auto.model_copy(update={"chosen": chosen})
    return replace(
        scenario, contact=replace(choice, auto=auto), text=text, notes=(*scenario.notes, note)
    )


def _hindrance(scenario: Scenario, choice: ContactChoice, states: list[_State], test: bool) -> str:
    """Return why a model does not support a scenario or solve all its contacts, or nothing.

    Tests take models that step implicitly: others need several times as many solutions. The exact
    theory, whose steps take minutes with many contacts, is not taken for them.
    """
    if choice.model == AUTO:
        return "it is not installed"
    if test and not choice.spec.capabilities.wear_compliance:
        return f"contact model '{choice.model}' takes no wear compliance"
    if test and choice.model == REFERENCE and len(states[0].batch) > _MOST_CONTACTS:
        return f"it would take too long for {len(states[0].batch)} contacts in each step"
    changed = replace(scenario, contact=choice)
    try:
        for state in states:
            model = prepared_model(changed, state.grid)
            if test:
                chosen_stepper(changed, model, scenario.operation.rollers)
            if choice.model != REFERENCE:
                model.solve(state.batch)
    except WearsimError as error:
        return error.message.removeprefix(f"{scenario.file}: ")
    return ""


def _coupling(scenario: Scenario) -> str:
    """Return why no error can be estimated for these materials, or an empty string."""
    pair = scenario.pair
    if abs(pair.dundurs) <= DUNDURS_LIMIT:
        return ""
    return f"different materials (Dundurs' constant {pair.dundurs:.3g}) are not calibrated"


def _not_calibrated(table: Calibration, states: list[_State]) -> str:
    """Return why no error can be estimated, or nothing."""
    for state in states:
        if not state.indicators:
            return "no cheap model solves the contact"
        batch = state.batch
        if batch.variation is not None:
            return "creepage.differential_slip = true is not calibrated"
        if batch.friction.ndim > 1:
            return "friction that varies across the track is not calibrated"
        for indicators in state.indicators:
            if outside := table.outside(indicators):
                return f"outside the calibrated contacts: {outside}"
    return ""


def _looked_at(scenario: Scenario, test: bool) -> tuple[list[_State], str]:
    """Return the states in which errors are estimated, and their description."""
    scout = replace(scenario, contact=_choice(scenario, "slender", {}), random=())
    if not test:
        return [_single(scout)], "in this contact"
    evolution = scout.evolution.model_copy(
        update={
            "stepper": "auto",
            "step": None,
            "nodes": None,
            "tolerance": _TOLERANCE,
            "strip_error": False,
        }
    )
    seen: list[tuple[WearProblem, WearState]] = []
    run: RunInProgress | None = None

    def watch(event: Event) -> None:
        if isinstance(event, Stepped) and run is not None:
            seen.append((run.present, run.recorder.state))

    mean = replace(scout, evolution=evolution)
    try:
        run = RunInProgress(mean, None, DISK, watch, None)
        problem = run.problem
        states = [_state(scout, problem.grid, unworn_contacts(problem))]
        run.finish()
    except SolverError:
        return [_single(scout)], "at the start of the test, which 'slender' does not step"
    early = min(seen, key=lambda pair: abs(float(pair[1].passes[0]) - _EARLY * run.stop))
    states += [_state(scout, pair[0].grid, present_batch(*pair)) for pair in (early, seen[-1])]
    return states, "at the start, after a tenth and at the end of the test with mean inputs"


def _single(scout: Scenario) -> _State:
    """Return the contact of the first roller at the start of the load."""
    setup = Setup(scout)
    force = setup.load_range(0.0)[0]
    grid = contact_grid(setup, force)
    state = _unworn(scout, grid)
    if not state.indicators and (wider := wider_grid(setup, grid, force)):
        state = _unworn(scout, wider)
    return state


def _unworn(scout: Scenario, grid: Grid) -> _State:
    problem = build_problem(Setup(scout), prepared_model(scout, grid), grid, {})
    return _state(scout, grid, unworn_contacts(problem))


def _state(scout: Scenario, grid: Grid, batch: ContactBatch) -> _State:
    """Return the indicators of contacts; none if no cheap model solves them all."""
    for name in _INDICATING:
        try:
            model = prepared_model(replace(scout, contact=_choice(scout, name, {})), grid)
            solutions = model.solve(batch)
        except WearsimError:
            continue
        loaded = batch.normal_force > _LEAST_LOAD * batch.normal_force.max()
        patches = [
            indicators_of(
                solutions[k],
                float(batch.longitudinal_curvature[k]),
                at_creepage(batch.point(k), solutions[k]),
                scout.friction.creep_factor,
            )
            for k in np.flatnonzero(loaded).tolist()
        ]
        return _State(grid, batch, patches)
    return _State(grid, batch, [])
