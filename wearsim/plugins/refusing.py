"""Refuses what a contact model is asked and does not claim, in one line of its `solve`."""

from __future__ import annotations

import numpy as np

from wearsim.errors import CapabilityError
from wearsim.plugins.contact_model import ContactModel
from wearsim.types import FloatArray, OperatingPoint


def refuse_unclaimed(
    model: ContactModel, point: OperatingPoint, wear_compliance: FloatArray | None = None
) -> None:
    """Raise unless a contact model claims all that it is asked.

    Parameters
    ----------
    model : ContactModel
        Its `capabilities` say what it claims.
    point : OperatingPoint
        What is asked.
    wear_compliance : ndarray, shape (strips,), optional
        As in `ContactModel.solve`.

    Raises
    ------
    CapabilityError
        Naming what is asked and not claimed.
    """
    rank = np.ndim(point.friction)
    asked = {
        "wear_compliance": (wear_compliance is not None, "a wear compliance"),
        "creepage_variation": (
            point.creepage.variation is not None,
            "a creepage that varies from strip to strip",
        ),
        "bearing_torque": (point.bearing_torque is not None, "a bearing torque"),
        "local_friction": (rank == 1, "friction that differs from strip to strip"),
        "friction_field": (rank > 1, "friction that differs from point to point"),
    }
    for name, (wanted, what) in asked.items():
        if wanted and not getattr(model.capabilities, name):
            raise CapabilityError(
                f"{type(model).__name__} takes no {what.removeprefix('a ')}, as its capabilities"
                f" say ({name}); choose a contact.model that does"
            )
