"""What a model is asked and does not claim is refused in a line, by the name of the capability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wearsim.errors import CapabilityError
from wearsim.plugins import Capabilities, refuse_unclaimed
from wearsim.types import Creepage, OperatingPoint

POINT = OperatingPoint(300.0, 2.6, Creepage(1e-3), 0.1)
EVEN = np.full(5, 0.1)
ASKED = {
    "wear_compliance": (POINT, EVEN),
    "creepage_variation": (replace(POINT, creepage=Creepage(1e-3, variation=EVEN)), None),
    "bearing_torque": (replace(POINT, bearing_torque=0.0, rolling_radius=EVEN), None),
    "local_friction": (replace(POINT, friction=EVEN), None),
    "friction_field": (replace(POINT, friction=EVEN[None]), None),
}


class Sponge:
    """A model as far as it matters here."""

    def __init__(self, **claims):
        self.capabilities = Capabilities(**claims)


@pytest.mark.parametrize("name", ASKED)
def test_that_what_is_not_claimed_is_refused_by_name(name):
    with pytest.raises(CapabilityError, match=rf"^Sponge takes no .* say \({name}\); choose"):
        refuse_unclaimed(Sponge(), *ASKED[name])
    others = {other: True for other in ASKED if other != name}
    with pytest.raises(CapabilityError, match=name):
        refuse_unclaimed(Sponge(**others), *ASKED[name])


@pytest.mark.parametrize("name", ASKED)
def test_that_what_is_claimed_is_let_through(name):
    refuse_unclaimed(Sponge(**{name: True}), *ASKED[name])


def test_that_a_plain_question_needs_no_claim():
    refuse_unclaimed(Sponge(), POINT)
