"""`refuse_unclaimed`: a missing capability is an error with its name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wearsim.errors import CapabilityError
from wearsim.plugins import Capabilities, ContactBatch, SharedWear, refuse_unclaimed
from wearsim.types import Creepage, OperatingPoint

POINT = OperatingPoint(300.0, 2.6, Creepage(1e-3), 0.1)
EVEN = np.full(5, 0.1)
PROBLEMS = {
    "wear_compliance": (POINT, EVEN[None]),
    "coupled": (POINT, None, SharedWear(np.zeros((1, 2), dtype=np.int64), np.zeros((1, 2, 5)))),
    "creepage_variation": (replace(POINT, creepage=Creepage(1e-3, variation=EVEN)), None),
    "bearing_torque": (replace(POINT, bearing_torque=0.0, rolling_radius=EVEN), None),
    "local_friction": (replace(POINT, friction=EVEN), None),
    "friction_field": (replace(POINT, friction=EVEN[None]), None),
}


def arguments(name):
    """Return the arguments of `solve` for a problem that requires a capability."""
    point, *others = PROBLEMS[name]
    return ContactBatch.of(EVEN[None], 90.0, [point]), *others


class Sponge:
    """A contact model reduced to its capabilities."""

    def __init__(self, **claims):
        self.capabilities = Capabilities(**claims)


@pytest.mark.parametrize("name", PROBLEMS)
def test_missing_capability_is_refused_by_name(name):
    message = rf"^Sponge does not support .* include {name}; choose"
    with pytest.raises(CapabilityError, match=message):
        refuse_unclaimed(Sponge(), *arguments(name))
    others = {other: True for other in PROBLEMS if other != name}
    with pytest.raises(CapabilityError, match=name):
        refuse_unclaimed(Sponge(**others), *arguments(name))


@pytest.mark.parametrize("name", PROBLEMS)
def test_claimed_capability_is_accepted(name):
    refuse_unclaimed(Sponge(**{name: True}), *arguments(name))


def test_plain_problem_needs_no_capability():
    refuse_unclaimed(Sponge(), ContactBatch.of(EVEN[None], 90.0, [POINT]))
