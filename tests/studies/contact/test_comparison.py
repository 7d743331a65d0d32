"""Difference of a contact from a reference model."""

from dataclasses import replace

import numpy as np
import pytest

import wearsim
from wearsim.errors import ContactError, PluginError
from wearsim.plugins import ContactModelSpec, Options, SingleContactModel, registry
from wearsim.plugins.manager import Registry
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact import comparison
from wearsim.studies.contact.comparison import solve_reference
from wearsim.types import Creepage, Grid, Material, OperatingPoint

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)


def test_model_does_not_differ_from_itself():
    study = wearsim.study_contact(shipped_scenario("rig-450min"), against="slender")
    assert set(vars(study.errors).values()) == {0.0}
    assert 0.0 < study.reference.own.dissipation < 0.01
    np.testing.assert_array_equal(study.reference.dissipation, study.solution.dissipation)


def test_differences_are_those_of_both_solutions():
    wide = {"contact.width": "4 mm", "contact.strips": 101}
    scenarios = [
        shipped_scenario("rig-450min", {"contact.model": model, **wide})
        for model in ("semi-hertzian", "slender")
    ]
    study = wearsim.study_contact(scenarios[0], against="slender")
    found, exact = (wearsim.solve_contact(scenario) for scenario in scenarios)
    norm = np.linalg.norm(found.dissipation - exact.dissipation) / np.linalg.norm(exact.dissipation)
    assert study.errors.dissipation == pytest.approx(norm, rel=1e-9)
    assert study.errors.power == pytest.approx(found.power / exact.power - 1.0, rel=1e-9)


def test_reference_extends_beyond_strips_that_end_with_the_contact():
    ended = {"contact.model": "hertz-fastsim", "contact.my": 24}
    study = wearsim.study_contact(shipped_scenario("rig-450min", ended), against="slender")
    assert len(study.reference.y) > len(study.solution.y) == 24
    assert np.ptp(np.diff(study.reference.y)) < 1e-12
    assert 0.05 < study.errors.dissipation < 0.2


def test_free_roller_is_compared_at_its_creepage():
    free = {"creepage": {"drive": "free", "bearing_torque": "0.02 N m"}}
    scenario = shipped_scenario("rig-450min", free)
    study = wearsim.study_contact(scenario, against="slender")
    assert study.errors.dissipation < 1e-9
    assert any("longitudinal creepage of this solution" in note for note in study.notes)


class _Elements(Options):
    mx: int = 20


class _Fails:
    """Reference with a relative error of P_l(y) of 1/mx**2, which fails for given numbers mx."""

    name = "fails"

    def __init__(self, unsolved):
        self.options, self.reference, self.unsolved = _Elements, True, unsolved

    def factory(self, options, grid, materials):
        slender = registry().get(ContactModelSpec, "slender")
        model = slender.factory(slender.options(), grid, materials)

        unsolved = self.unsolved

        class Elements(SingleContactModel):
            def solve_contact(self, *contact):
                if options.mx in unsolved:
                    raise ContactError("no contact")
                found = model.solve_one(*contact)
                return replace(found, dissipation=found.dissipation * (1.0 + options.mx**-2))

        return Elements()


@pytest.mark.parametrize(("unsolved", "taken"), [((), (60, 40)), ((60,), (40, 30))])
def test_reference_has_the_finest_elements_and_the_change_from_fewer(monkeypatch, unsolved, taken):
    monkeypatch.setattr(comparison, "reference_spec", lambda _: _Fails(unsolved))
    grid = Grid.spanning(-2e-3, 2e-3, 80)
    contact = grid, (STEEL, STEEL), grid.y**2, 90.0
    point = OperatingPoint(300.0, 1.0, Creepage(1e-3, 0.0, 0.0), 0.1)
    found = solve_reference("any", *contact, point)
    fine, coarse = (1.0 + number**-2 for number in taken)
    assert found.own.dissipation == pytest.approx(coarse / fine - 1.0, rel=1e-6)
    monkeypatch.setattr(comparison, "reference_spec", lambda _: _Fails((60, 40, 30)))
    with pytest.raises(ContactError):
        solve_reference("any", *contact, point)


def test_missing_plugin_is_named_with_its_installation(monkeypatch):
    names = Registry.names
    monkeypatch.setattr(
        Registry, "names", lambda self, kind: [n for n in names(self, kind) if n != "halfspace"]
    )
    with pytest.raises(PluginError, match=r"'halfspace' is installed; install it with: pip"):
        wearsim.study_contact(shipped_scenario("rig-450min"), against="halfspace")
    with pytest.raises(PluginError, match="there are hertz"):
        wearsim.study_contact(shipped_scenario("rig-450min"), against="half")


def test_reference_on_other_strips_has_the_creepage_and_friction_there():
    grid = Grid.spanning(-2e-3, 2e-3, 80)
    varied = OperatingPoint(
        300.0, 1.0, Creepage(1e-3, 0.0, 0.0, 1e-4 * grid.y / 1e-3), 0.1 + 10.0 * np.abs(grid.y)
    )
    found = solve_reference("slender", grid, (STEEL, STEEL), grid.y**2, 90.0, varied)
    assert 0.0 < found.own.dissipation < 0.02
