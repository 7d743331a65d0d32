"""Errors of contact models of plugins that return invalid solutions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plugin_examples import Point, module, rig

import wearsim
from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import ContactError, PluginError, WearsimError
from wearsim.plugins import ContactModel, ContactModelSpec, Options, SingleContactModel, registry
from wearsim.plugins.checked_model import CheckedModel
from wearsim.scenario import Scenario
from wearsim.types import Grid

PER_PASS = {"evolution.stepper": "per-pass", "operation.duration": "1 s"}
ROLLERS = {"roller.offset": ["-0.5 mm", "0 mm", "0.5 mm"]}  # three contacts in a batch
Fault = Callable[[Any], Any]


def changed(**fields: Callable[[Any], Any]) -> Fault:
    """Return a fault that changes fields of a solution."""
    return lambda s: replace(s, **{name: of(getattr(s, name)) for name, of in fields.items()})


def with_first(value: float) -> Callable[[Any], Any]:
    """Return a function that replaces the first number of an array."""

    def replaced(values: Any) -> Any:
        values = np.array(values)
        values.flat[0] = value
        return values

    return replaced


#: faults by their description, with the error, which also holds for batches
FAULTS: dict[str, tuple[Fault, type[WearsimError], str]] = {
    "None": (lambda s: None, PluginError, "returned None, expected a Contact"),
    "array": (
        lambda s: s.line_load,
        PluginError,
        "returned an array of the shape .*, expected a Contact",
    ),
    "strips": (
        changed(dissipation=lambda v: v[..., :-1]),
        PluginError,
        r"returned an array of the shape .* as dissipation, expected an array of the shape \(.*81",
    ),
    "type": (
        changed(line_load=lambda v: v.astype(str)),
        PluginError,
        "returned an array of the shape .* and type <U.* as line_load, expected",
    ),
    "no number": (
        changed(approach=lambda v: None),
        PluginError,
        "returned None as approach, expected a",
    ),
    "nan in a strip": (
        changed(dissipation=with_first(np.nan)),
        ContactError,
        "returned dissipation that is not finite",
    ),
    "infinite number": (
        changed(peak_pressure=lambda v: v * np.inf),
        ContactError,
        "returned peak_pressure that is not finite",
    ),
    "negative": (
        changed(dissipation=lambda v: -v),
        ContactError,
        "returned a negative dissipation of -.* W/m",
    ),
}


@pytest.fixture
def faulty(install: Callable[..., None], monkeypatch: pytest.MonkeyPatch, tiny: None) -> Any:
    """Return a function that returns a test with a model that has a fault from a call on."""
    from wearsim_tiny import Foundation, FoundationOptions

    def scenario(
        fault: Fault, batched: bool, from_call: int, overrides: dict[str, Any]
    ) -> Scenario:
        calls = iter(range(10**6))

        def faulty(solution: Any) -> Any:
            return fault(solution) if next(calls) >= from_call else solution

        class Single(Foundation):  # type: ignore[misc]
            def solve_contact(self, *arguments: Any, **named: Any) -> Any:
                return faulty(super().solve_contact(*arguments, **named))

        class Batched(ContactModel):
            def __init__(self, *arguments: Any) -> None:
                self.inner: SingleContactModel = Foundation(*arguments)

            def solve(self, *arguments: Any, **named: Any) -> ContactBatchSolution:
                return faulty(self.inner.solve(*arguments, **named))

        spec = ContactModelSpec(
            "faulty",
            FoundationOptions,
            "a model with a fault",
            factory=Batched if batched else Single,
            protocol=2,
        )
        install(Point(module(wearsim_contact_models=lambda: [spec])))
        return rig(overrides, contact='model = "faulty"\nwidth = "8 mm"\nstrips = 81')

    return scenario


@pytest.mark.parametrize("batched", [False, True], ids=["single", "batched"])
@pytest.mark.parametrize(("fault", "kind", "message"), FAULTS.values(), ids=FAULTS)
def test_fault_is_named_with_the_model(faulty, fault, kind, message, batched):
    for study in (wearsim.solve_contact, wearsim.run):
        for overrides in ({}, ROLLERS):
            with pytest.raises(kind, match=f"contact model 'faulty' {message}") as caught:
                study(faulty(fault, batched, 0, overrides))
            assert type(caught.value) is kind


#: all pairs of a fault, a form of the model and a way of stepping are tested, others are slow
RUNS = [
    pytest.param(
        fault,
        batched,
        by_passes,
        marks=[pytest.mark.slow] * ((number + batched + by_passes) % 2),
        id=f"{fault}-{'passes' if by_passes else 'steps'}-{'batched' if batched else 'single'}",
    )
    for number, fault in enumerate(FAULTS)
    for by_passes in (False, True)
    for batched in (False, True)
]


@pytest.mark.parametrize(("name", "batched", "by_passes"), RUNS)
def test_fault_during_a_run_is_named(faulty, name, batched, by_passes, tmp_path):
    (fault, kind, message), overrides = FAULTS[name], PER_PASS if by_passes else {}
    scenario = faulty(fault, batched, 8, overrides)
    with pytest.raises(kind, match=f"contact model 'faulty' {message}"):
        wearsim.run(scenario, tmp_path / "rig.h5")
    stored = wearsim.open_results(tmp_path / "rig.h5")
    assert not stored.finished
    assert "contact model 'faulty' returned" in stored.raw.failure


def test_error_has_the_state_that_led_to_it(faulty):
    with pytest.raises(ContactError) as caught:
        wearsim.run(faulty(changed(dissipation=with_first(-1.0)), True, 0, ROLLERS))
    state = caught.value.state
    assert state["contact"] == [0, 0, 0]
    assert state["normal_force"] == state["point"].normal_force == 300.0
    assert state["gap"].shape == state["dissipation"].shape == (81,)
    assert state["dissipation"][0] == -1.0


def test_rounding_below_zero_is_no_fault(faulty):
    tiny_negative = changed(dissipation=lambda v: np.where(v > 0.0, v, -1e-12 * v.max()))
    assert wearsim.run(faulty(tiny_negative, False, 0, {})).finished


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("energy", np.nan, "energy that is not finite"),
        ("energy", -1.0, "a negative energy"),
        ("cylinder_depth", np.inf, "cylinder_depth that is not finite"),
        ("roller_depth", np.nan, "roller_depth that is not finite"),
    ],
)
def test_fault_of_compiled_passes_is_named(name, value, message):
    class Compiled(ContactModel):
        def solve(self, *arguments: Any) -> Any:
            raise NotImplementedError

        def pass_loop(self, loop: Any) -> int:
            getattr(loop, name)[...] = value
            return 1

    states = {key: np.zeros(3) for key in ("energy", "cylinder_depth", "roller_depth")}
    with pytest.raises(ContactError, match=f"contact model 'compiled' returned {message}"):
        CheckedModel(Compiled(), "compiled").pass_loop(SimpleNamespace(**states))


def test_factory_without_a_model_is_named(install):
    spec = ContactModelSpec(
        "faulty", Options, "no model", factory=lambda *arguments: None, protocol=2
    )
    install(Point(module(wearsim_contact_models=lambda: [spec])))
    message = "the factory of contact model 'faulty' returned None, expected a ContactModel"
    with pytest.raises(PluginError, match=message):
        wearsim.run(rig(contact='model = "faulty"\nwidth = "8 mm"\nstrips = 81'))


def test_models_of_wearsim_are_not_wrapped():
    names = registry().names(ContactModelSpec)
    built_in = [
        name
        for name in names
        if registry().registered(ContactModelSpec, name).distribution == "wearsim"
    ]
    assert "slender" in built_in
    for name in built_in:
        scenario = rig(contact=f'model = "{name}"\nwidth = "8 mm"\nstrips = 81')
        grid = Grid.spanning(-4e-3, 4e-3, 81)
        built = scenario.contact.build(grid, scenario.materials)
        assert type(built).__module__.startswith("wearsim.models."), name


def test_solve_contact_with_other_arguments_is_named(install):
    class Short(SingleContactModel):
        def __init__(self, *arguments: Any) -> None:
            pass

        def solve_contact(self, gap: Any, point: Any) -> Any:  # type: ignore[override]
            raise NotImplementedError

    spec = ContactModelSpec("faulty", Options, "a model", factory=Short, protocol=2)
    install(Point(module(wearsim_contact_models=lambda: [spec])))
    wanted = r"gap, longitudinal_curvature, point, wear_compliance, warm\)"
    text = rf"solve_contact of contact model 'faulty' takes \(gap, point\), expected \({wanted}"
    with pytest.raises(PluginError, match=text):
        wearsim.run(rig(contact='model = "faulty"'))
