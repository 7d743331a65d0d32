"""Conformance tests of fatigue laws."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.plugins import FatigueLaw, FatigueLawSpec
from wearsim.testing.checks import (
    Checks,
    Fixture,
    require,
    require_instance,
    require_repeatable,
    require_values,
    spec_checks,
)
from wearsim.types import FloatArray

_MODULUS = 110e9  # E* of two steel bodies [Pa]
_PRESSURES = np.linspace(0.0, 3e9, 301)
FATIGUE_LAW: Checks[FatigueLawFixture] = spec_checks()
_DAMAGE = "wearsim.plugins.FatigueLaw.damage_per_pass"


class FatigueLawFixture(Fixture[FatigueLawSpec]):
    """A fatigue law under test."""

    def fresh(self) -> Any:
        """Return a new instance."""
        return self.configured.spec.factory(self.configured.options, _MODULUS)

    def damage(self, pressure: FloatArray) -> FloatArray:
        """Return the damage of one overrolling."""
        return np.asarray(self.instance.damage_per_pass(pressure))


@FATIGUE_LAW.specified_in("wearsim.plugins.FatigueLawSpec")
def factory_builds_a_fatigue_law(fixture: FatigueLawFixture) -> None:
    """The factory builds a FatigueLaw."""
    require_instance(fixture, FatigueLaw)


@FATIGUE_LAW.specified_in(_DAMAGE)
def damage_is_elementwise(fixture: FatigueLawFixture) -> None:
    """The damage has the shape of the pressures, and one does not depend on the others."""
    pressures = _PRESSURES[1:].reshape(3, 100)
    damage = fixture.damage(pressures)
    require_values("the damage", damage, pressures.shape)
    singly = np.concatenate([fixture.damage(pressure) for pressure in pressures.reshape(-1, 1)])
    require(np.array_equal(singly, damage.ravel()), "the damage depends on other pressures")


@FATIGUE_LAW.specified_in(_DAMAGE)
def no_damage_without_pressure(fixture: FatigueLawFixture) -> None:
    """The damage is zero where the pressure is zero."""
    damage = float(fixture.damage(np.array([1e9, 0.0]))[1])
    require(damage == 0.0, f"the damage without pressure is {damage:.3g}")


@FATIGUE_LAW.specified_in(_DAMAGE)
def damage_never_falls_with_the_pressure(fixture: FatigueLawFixture) -> None:
    """The damage is never less at a greater pressure, and is above zero at 3 GPa."""
    damage = fixture.damage(_PRESSURES)
    require((np.diff(damage) >= 0.0).all(), "the damage falls with the pressure")
    require(damage[-1] > 0.0, "the damage at 3 GPa is zero")


@FATIGUE_LAW.specified_in(_DAMAGE)
def damage_is_repeatable(fixture: FatigueLawFixture) -> None:
    """Two instances give the same damage in every call, and leave the pressures as they are."""
    others = {"another instance": fixture.fresh().damage_per_pass}
    require_repeatable("the damage", fixture.instance.damage_per_pass, others, _PRESSURES)
