"""The contact model `winkler`: an elastic foundation, strip by strip, in gross sliding."""

from typing import Annotated

import numpy as np

import wearsim.plugins as ws
from wearsim.types import ContactSolution

Modulus = Annotated[float, ws.Quantity(ws.Kind("a modulus", "Pa/m", "1000 GPa/mm"), "positive")]


class WinklerOptions(ws.Options):
    """Options of the contact model `winkler`, validated with their units."""

    half_length: ws.PositiveLength = ws.Field(0.13e-3, description="of a strip with Hertzian load")
    foundation_modulus: Modulus | None = ws.Field(None, description="instead: pressure per depth")


class Winkler(ws.SingleContactModel):
    """Independent springs: the pressure is the modulus times the depth, friction mu times it."""

    capabilities = ws.Capabilities(creepage_variation=True, local_friction=True)

    def __init__(self, options, grid, materials):
        # by default K = 3 pi E*/(8 a), see README.md
        compliance = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in materials)  # 1/E*
        by_hertz = 3.0 * np.pi / (8.0 * compliance * options.half_length)
        self.grid, self.modulus = grid, options.foundation_modulus or by_hertz

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        """Solve one contact; `warm` is not used."""
        force, spacing = point.normal_force, self.grid.spacing
        if not (0.0 < force < np.inf and np.isfinite(gap).all()):
            raise ws.ContactError(f"no contact: load {force:.4g} N or a gap that is not finite")
        stiffness = 4.0 / 3.0 * self.modulus * np.sqrt(2.0 / longitudinal_curvature)

        def depth(approach):
            return np.maximum(approach - gap, 0.0)

        def excess(approach):
            return stiffness * (depth(approach) ** 1.5).sum() * spacing - force

        # approach at which a single strip carries the load
        reach = (force / spacing / stiffness) ** (2.0 / 3.0)
        low = float(gap.min())
        from scipy.optimize import brentq  # slow to import, and every plugin is imported at start

        approach = brentq(excess, low, low + 1.01 * reach, xtol=1e-20, rtol=1e-14)
        if depth(approach)[[0, -1]].any():
            raise ws.ContactError("the contact reaches the edge of its strips; raise contact.width")
        return self._slide(depth(approach), stiffness, longitudinal_curvature, point, approach)

    def _slide(self, depth, stiffness, longitudinal_curvature, point, approach):
        """Return the solution of sliding strips, with the local rigid slip of each."""
        y, load, creepage = self.grid.y, stiffness * depth**1.5, point.creepage
        half_length = np.sqrt(2.0 * depth / longitudinal_curvature)
        varies = -creepage.spin * y if creepage.variation is None else creepage.variation
        along = creepage.longitudinal + varies - np.average(varies, weights=load)
        slip = np.hypot(along, creepage.lateral)
        traction = -point.friction * load / np.where(slip > 0.0, slip, 1.0)  # per slip [N/m]
        dissipation = -traction * slip**2 * point.rolling_speed
        arm = y - np.average(y, weights=load)
        sums = dissipation, traction * along, traction * creepage.lateral, -traction * along * arm
        power, force_x, force_y, moment = (float(part.sum()) * self.grid.spacing for part in sums)
        if not np.isfinite(power):
            raise ws.ContactError("the power is not finite; check creepage, friction and speed")
        return ContactSolution(
            *(y, half_length, load, dissipation, force_x, force_y, moment, approach),
            peak_pressure=self.modulus * float(depth.max()),
            adhesion_fraction=0.0,
            power=power,
            longitudinal_creepage=creepage.longitudinal,
            iterations=1,
        )


SPEC = ws.ContactModelSpec(
    *("winkler", WinklerOptions, "elastic foundation in gross sliding"),
    factory=Winkler,
    capabilities=Winkler.capabilities,
    protocol=2,
)

KIND = ws.StudyKind(
    *("winkler-approach", "approach of the bodies by normal force"),
    result="wearsim_template.study:Approach",
    view="wearsim_template.study:ApproachView",
    protocol=2,
)


class WinklerFormOptions(ws.Options):
    """Options of the form along the axis `winkler-quartic`."""

    length: ws.PositiveLength = ws.Field(description="length of the body")
    drop: ws.PositiveLength = ws.Field(20e-6, description="drop at the ends")


class WinklerForm(ws.AxialProfile):
    """A body whose drop rises with the fourth power of the distance from its middle."""

    def __init__(self, options, pair):
        self.length, self.end_drop = options.length, options.drop

    def drop(self, s):
        """Return the distance of the surface below its highest line [m]."""
        return self.end_drop * (2.0 * s / self.length) ** 4


FORM = ws.AxialProfileSpec(
    *("winkler-quartic", WinklerFormOptions, "drop with the fourth power of the distance"),
    factory=WinklerForm,
    protocol=2,
)


class ApproachTable(ws.Options):
    """The table `[winkler-approach]` of a scenario: settings of the study of this name."""

    greatest_force: ws.PositiveForce = ws.Field(500.0, description="last force of the study")
    forces: int = ws.Field(5, ge=1, description="number of forces")

    @property
    def values(self):
        """The forces [N]."""
        return np.linspace(0.0, self.greatest_force, self.forces + 1)[1:]


TABLE = ws.TableSpec("winkler-approach", ApproachTable, "forces of the study", protocol=2)


@ws.hookimpl
def wearsim_axial_profiles():
    """Yield the form along the axis."""
    yield FORM


@ws.hookimpl
def wearsim_contact_models():
    """Yield the contact model."""
    yield SPEC


@ws.hookimpl
def wearsim_study_kinds():
    """Yield the kind of study."""
    yield KIND


@ws.hookimpl
def wearsim_tables():
    """Yield the table that the study owns."""
    yield TABLE
