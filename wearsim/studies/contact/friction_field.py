"""Friction field of a contact, evaluated at the points of the contact model."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, Mistake, ScenarioError
from wearsim.plugins import ContactModel, ContactModelSpec, FrictionField, registry
from wearsim.scenario import RandomInput, Scenario
from wearsim.types import FloatArray
from wearsim.uq.sampling.philox import Stream

_MAX_POINTS = 2**20  # upper limit of the search for a sufficient number


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
        If the model supports no friction field, or the creepage is not prescribed.
    """

    def __init__(self, scenario: Scenario, model: ContactModel, item: RandomInput) -> None:
        if not isinstance(item.distribution, FrictionField):
            raise TypeError(f"{item.name} is no field")
        self._scenario, self._item, self._field = scenario, item, item.distribution
        self._stream = Stream(scenario.seed, item.name, "field")
        if not model.capabilities.friction_field:
            specs = [
                registry().get(ContactModelSpec, name)
                for name in registry().names(ContactModelSpec)
            ]
            names = [f"'{spec.name}'" for spec in specs if spec.capabilities.friction_field]
            models = f"contact.model = {' or '.join(names)}" if names else "another distribution"
            raise CapabilityError(
                f"{scenario.file}: contact model '{scenario.contact.model}' does not support"
                f" friction that varies within the contact, {item.name} with distribution ="
                f" '{item.kind}'; choose {models}"
            )
        if scenario.creepage.drive != "creepage":
            raise CapabilityError(
                f"{scenario.file}: a friction field, {item.name}, requires prescribed creepage; set"
                " creepage.drive = 'creepage', or give the friction a distribution"
            )

    def check(self, x: FloatArray, spacing: float) -> None:
        """Check that points resolve the field.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Positions along rolling in the longest contact [m].
        spacing : float
            Width of a strip [m].

        Raises
        ------
        ScenarioError
            If the points are too far apart.
        """
        # the first point is one spacing behind the leading edge, the last at the trailing edge
        along = float(2.0 * np.abs(x).max() / len(x))
        mistake = self._field.unresolved(along, spacing)
        if mistake is not None:
            table, key = self._item.name.split(".", 1)
            remedy = finer_grid(self._scenario, self._field, len(x), along, spacing)
            raise ScenarioError(
                self._scenario.file, [Mistake(table, key, mistake, self._item.describe(), remedy)]
            )

    def put(self, batch: ContactBatch, x: FloatArray, y: FloatArray, first: int) -> ContactBatch:
        """Return the contacts of consecutive realisations with their local friction.

        Parameters
        ----------
        batch : ContactBatch
        x : ndarray, shape (contacts, points, strips)
            Positions along rolling, from the leading edge [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        first : int
            The first realisation.
        """
        friction = np.empty_like(x)
        for row in range(len(x)):
            uniforms = partial(self._stream.uniforms, realisation=first + row)
            friction[row] = self._field.values(x[row], y, uniforms)
        carried = self._field.frame != "contact"
        return replace(batch, friction=friction, friction_carried=carried)


def finer_grid(
    scenario: Scenario, friction: FrictionField, points: int, along: float, across: float
) -> str:
    """Return the settings for which a grid resolves a friction field.

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
        "contact.my = 124": key and least value for either direction that is too coarse.
    """
    choice = scenario.contact
    settings = []
    if friction.unresolved(along, 0.0) is not None:
        needed = _least(points, lambda count: friction.unresolved(along * points / count, 0.0))
        has_key = hasattr(choice.options, "mx")
        settings.append(f"contact.mx = {needed}" if has_key else f"{needed} points along rolling")
    if friction.unresolved(0.0, across) is not None:
        strips = choice.strips or getattr(choice.options, "my", None)
        if strips is None:
            settings.append("more contact.strips")
        else:
            needed = _least(strips, lambda count: friction.unresolved(0.0, across * strips / count))
            settings.append(f"contact.{'strips' if choice.strips else 'my'} = {needed}")
    return " and ".join(settings)


def _least(count: int, unresolved: Callable[[int], str | None]) -> int:
    """Return the least resolving count above one that does not resolve."""
    counts = range(count + 1, _MAX_POINTS)
    return count + 1 + bisect_left(counts, True, key=lambda points: unresolved(points) is None)
