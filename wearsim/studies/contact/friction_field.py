"""A friction field in realisations of a contact: its own numbers, at the model's own points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.errors import CapabilityError, Mistake, ScenarioError
from wearsim.plugins import ContactModel, ContactModelSpec, FrictionField, registry
from wearsim.scenario import RandomInput, Scenario
from wearsim.types import FloatArray
from wearsim.uq.sampling.philox import Stream


class LocalFriction:
    """The friction field of a scenario.

    Parameters
    ----------
    scenario : Scenario
    model : ContactModel
    item : RandomInput
        The field.

    Raises
    ------
    CapabilityError
        If the model takes no friction field, or not with rollers that find their own creepage.
    """

    def __init__(self, scenario: Scenario, model: ContactModel, item: RandomInput) -> None:
        if not isinstance(item.distribution, FrictionField):
            raise TypeError(f"{item.name} is no field")
        self._scenario, self._item, self._field = scenario, item, item.distribution
        self._stream = Stream(scenario.seed, item.name, "field")
        if not model.capabilities.friction_field:
            raise CapabilityError(
                f"{scenario.file}: contact model '{scenario.contact.model}' cannot take friction"
                f" that differs within the contact, {item.name} with distribution ="
                f" '{item.kind}'; choose {_able_models()}"
            )
        if scenario.creepage.drive != "creepage":
            raise CapabilityError(
                f"{scenario.file}: a friction field, {item.name}, needs prescribed creepage; set"
                " creepage.drive = 'creepage', or give the friction a distribution"
            )

    def check(self, x: FloatArray, spacing: float) -> None:
        """Refuse points that do not resolve the field.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Where friction is taken in the longest contact [m].
        spacing : float
            Width of a strip [m].

        Raises
        ------
        ScenarioError
            If they are too far apart.
        """
        # the march begins at the leading edge, where there is no point yet, and ends in one at the
        # trailing edge
        along = float(2.0 * np.abs(x).max() / len(x))
        wrong = self._field.unresolved(along, spacing)
        if wrong is not None:
            table, key = self._item.name.split(".", 1)
            remedy = finer_grid(self._scenario, self._field, len(x), along, spacing)
            problem = Mistake(table, key, wrong, self._item.describe(), remedy)
            raise ScenarioError(self._scenario.file, [problem])

    def put(
        self, points: OperatingPoints, x: FloatArray, y: FloatArray, first: int
    ) -> OperatingPoints:
        """Return the points of some realisations on end, each with its own friction.

        Parameters
        ----------
        points : OperatingPoints
        x : ndarray, shape (contacts, points, strips)
            Where friction is asked for, from the leading edge on [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        first : int
            The first realisation.
        """
        friction = np.empty_like(x)
        for row in range(len(x)):
            own = partial(self._stream.uniforms, realisation=first + row)
            friction[row] = self._field.values(x[row], y, own)
        carried = self._field.frame != "contact"
        return replace(points, friction=friction, friction_carried=carried)


def _able_models() -> str:
    """Return the models that take a friction field, as a user would choose them."""
    specs = [registry().get(ContactModelSpec, name) for name in registry().names(ContactModelSpec)]
    able = [f"'{spec.name}'" for spec in specs if spec.capabilities.friction_field]
    return f"contact.model = {' or '.join(able)}" if able else "another distribution"


_MOST = 2**20  # points that are tried


def finer_grid(
    scenario: Scenario, friction: FrictionField, points: int, along: float, across: float
) -> str:
    """Return the settings with which a grid resolves a friction field.

    Parameters
    ----------
    scenario : Scenario
    friction : FrictionField
    points : int
        Points along rolling in each strip.
    along, across : float
        Their spacing, and the width of a strip [m].

    Returns
    -------
    str
        "contact.my = 124": of either direction that is too coarse, the key and its least value.
    """
    choice = scenario.contact
    settings = []
    if friction.unresolved(along, 0.0) is not None:
        needed = _least(points, lambda count: friction.unresolved(along * points / count, 0.0))
        named = hasattr(choice.options, "mx")
        settings.append(f"contact.mx = {needed}" if named else f"{needed} points along rolling")
    if friction.unresolved(0.0, across) is not None:
        strips = choice.strips or getattr(choice.options, "my", None)
        key = "contact.strips" if choice.strips else "contact.my"
        if strips is None:
            settings.append("more contact.strips")
        else:
            needed = _least(strips, lambda count: friction.unresolved(0.0, across * strips / count))
            settings.append(f"{key} = {needed}")
    return " and ".join(settings)


def _least(count: int, wrong: Callable[[int], str | None]) -> int:
    """Return the least count beyond a wrong one that is not wrong."""
    refused, taken = count, 2 * count
    while wrong(taken) is not None and taken < _MOST:
        refused, taken = taken, 2 * taken
    while taken - refused > 1:
        middle = (refused + taken) // 2
        if wrong(middle) is None:
            taken = middle
        else:
            refused = middle
    return taken
