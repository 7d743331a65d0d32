"""Error of a contact model on one contact, relative to another contact model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.errors import ContactError, PluginError, WearsimError
from wearsim.plugins import ContactModel, ContactModelSpec, Options, registry
from wearsim.plugins.checked_model import CheckedModel
from wearsim.plugins.manager import built_plugin
from wearsim.types import ContactSolution, FloatArray, Grid, Material, OperatingPoint

REFERENCE = "halfspace"  # the exact theory
#: Numbers of elements along rolling over the usual one; the first two that solve are the reference.
RESOLUTIONS = (3.0, 2.0, 1.5, 1.0)
FEW = (1.0, 0.5)  # of a check during a run
#: How to install models of the project's plugins.
INSTALL = {"halfspace": "pip install ./plugins/wearsim-halfspace"}

#: Builds a model with some options for strips.
Build = Callable[[Options, Grid], ContactModel]
_SOLUTIONS = 2  # of a reference
_SCALARS = ("power", "peak_pressure", "half_length", "adhesion_fraction")


@dataclass(frozen=True)
class ContactErrors:
    """Differences of a contact from a reference; signed, except of P_l(y).

    Parameters
    ----------
    dissipation : float
        L2 norm over the strips of the difference of P_l(y), over the norm of the reference.
    greatest : float
        Greatest difference of P_l(y), over the greatest value of the reference.
    power, peak_pressure, half_length : float
        Relative differences of power, peak pressure and greatest half-length.
    adhesion_fraction : float
        Difference of the adhesion fraction.
    """

    dissipation: float
    greatest: float
    power: float
    peak_pressure: float
    half_length: float
    adhesion_fraction: float


@dataclass(frozen=True, eq=False)
class ContactReference:
    """Values of a contact by a reference model, and their own discretisation errors.

    Parameters
    ----------
    model : str
        Name of the model.
    y : ndarray, shape (strips,)
        Axial position of its strips [m], which may extend beyond the contact's.
    dissipation : ndarray, shape (strips,)
        P_l(y) [W/m].
    line_load : ndarray, shape (strips,)
        q(y) [N/m].
    power, peak_pressure, half_length, adhesion_fraction : float
        Power [W], peak pressure [Pa], greatest half-length [m], adhesion fraction.
    own : ContactErrors
        Estimated errors of these values that are due to the elements, not negative.
    seconds : float
        Time of all solutions [s].
    """

    model: str
    y: FloatArray
    dissipation: FloatArray
    line_load: FloatArray
    power: float
    peak_pressure: float
    half_length: float
    adhesion_fraction: float
    own: ContactErrors
    seconds: float

    def errors_of(self, solution: ContactSolution) -> ContactErrors:
        """Return the differences of a solution on strips of the same width from the reference."""
        scalars = self.power, self.peak_pressure, self.half_length, self.adhesion_fraction
        reference = np.concatenate([scalars, self.line_load, self.dissipation])
        return _differences(_values(solution, (len(self.y) - len(solution.y)) // 2), reference)


def reference_spec(name: str) -> ContactModelSpec:
    """Return an installed contact model.

    Parameters
    ----------
    name : str
        Its registered name.

    Raises
    ------
    PluginError
        If it is not installed, with the remedy.
    """
    names = registry().names(ContactModelSpec)
    if name not in names:
        remedy = (
            f"install it with: {INSTALL[name]}"
            if name in INSTALL
            else f"there are {', '.join(names)}"
        )
        raise PluginError(f"no contact model '{name}' is installed; {remedy}")
    return registry().get(ContactModelSpec, name)


def solve_reference(
    name: str,
    grid: Grid,
    materials: tuple[Material, Material],
    gap: FloatArray,
    longitudinal_curvature: float,
    point: OperatingPoint,
    resolutions: tuple[float, ...] = RESOLUTIONS,
    creep_factor: float = 1.0,
) -> ContactReference:
    """Solve a contact with a reference model, and estimate the reference's own errors.

    A model whose elements along rolling are chosen by the option `mx` is solved with two numbers of
    them. The values are those with more elements, and the error stated is the change from fewer. It
    is an upper estimate where errors decrease with the square of the length of the elements.
    P_l(y) is not extrapolated: as single elements enter and leave the adhesion zone, it varies
    irregularly. Another model is solved with half as many strips too; the change is stated.

    Parameters
    ----------
    name : str
        Registered name of the model, with its default options.
    grid, materials, gap, longitudinal_curvature, point
        The contact, as for `ContactModel.solve_one`.
    resolutions : tuple of float
        Numbers of elements along rolling, over the usual number, the greatest first.
    creep_factor : float
        As in `ContactModel.with_creep_factor`.

    Returns
    -------
    ContactReference

    Raises
    ------
    PluginError
        If the model is not installed.
    ContactError, CapabilityError
        If it does not solve the contact.

    Examples
    --------
    >>> study = wearsim.study_contact("rig.toml", against="semi-hertzian")
    >>> study.reference.model, study.errors.power < 0.01
    ('semi-hertzian', True)
    """
    spec = reference_spec(name)
    start = perf_counter()

    def solve(options: Options, on: Grid) -> FloatArray:
        heights = gap if on is grid else np.interp(on.y, grid.y, gap)
        model: ContactModel = built_plugin(spec, ContactModel, CheckedModel, options, on, materials)
        if creep_factor != 1.0:
            model = model.with_creep_factor(creep_factor)
        return _values(model.solve_one(heights, longitudinal_curvature, _on(point, grid, on)))

    if spec.reference and "mx" in spec.options.model_fields:
        usual, solutions = spec.options.model_fields["mx"].default, []
        for part in resolutions:
            try:
                solutions.append(
                    solve(spec.options.model_validate({"mx": round(part * usual)}), grid)
                )
            except ContactError as error:
                failure = error
            if len(solutions) == _SOLUTIONS:
                break
        else:
            raise failure
        values, coarse = solutions
    else:
        values = solve(spec.options(), grid)
        half = Grid.spanning(*grid.edges, (grid.strips + 1) // 2)
        coarse, scalars = solve(spec.options(), half), len(_SCALARS)
        coarse = np.concatenate(
            [
                coarse[:scalars],
                *[np.interp(grid.y, half.y, field) for field in coarse[scalars:].reshape(2, -1)],
            ]
        )
    line_load, dissipation = values[len(_SCALARS) :].reshape(2, -1)
    return ContactReference(
        name,
        grid.y,
        dissipation,
        line_load,
        **dict(zip(_SCALARS, values[: len(_SCALARS)].tolist(), strict=True)),
        own=ContactErrors(
            **{name: abs(error) for name, error in vars(_differences(coarse, values)).items()}
        ),
        seconds=perf_counter() - start,
    )


def at_creepage(point: OperatingPoint, solution: ContactSolution) -> OperatingPoint:
    """Return the operating point with the longitudinal creepage of a solution prescribed."""
    return replace(
        point,
        creepage=replace(point.creepage, longitudinal=solution.longitudinal_creepage),
        bearing_torque=None,
        rolling_radius=None,
    )


def error_above_tolerance(
    name: str,
    model: ContactModel,
    grid: Grid,
    materials: tuple[Material, Material],
    batch: ContactBatch,
    tolerance: float,
    creep_factor: float = 1.0,
) -> str:
    """Return how far the error of a model exceeds a tolerance in the most loaded contact.

    Parameters
    ----------
    name : str
        The reference model.
    model : ContactModel
        The model.
    grid, materials
        Strips and bodies.
    batch : ContactBatch
        The contacts.
    tolerance : float
        Of P_l(y), L2 over the strips.
    creep_factor : float
        Of the model.

    Returns
    -------
    str
        Empty if the error is within the tolerance and the reference's own error, or the reference
        does not solve the contact.
    """
    number = int(np.argmax(batch.normal_force))
    gap, curvature = batch.gap[number], float(batch.longitudinal_curvature[number])
    try:
        solution = model.solve_one(gap, curvature, batch.point(number))
        point = at_creepage(batch.point(number), solution)
        reference = solve_reference(name, grid, materials, gap, curvature, point, FEW, creep_factor)
    except WearsimError:
        return ""
    error, error_of_reference = reference.errors_of(solution).dissipation, reference.own.dissipation
    if error <= tolerance + error_of_reference:
        return ""
    return (
        f"P_l(y) differs by {100.0 * error:.2g} % from '{name}' (whose own error is"
        f" {100.0 * error_of_reference:.2g} %), tolerance {100.0 * tolerance:g} %"
    )


def _values(solution: ContactSolution, beyond: int = 0) -> FloatArray:
    """Return scalars, q(y) and P_l(y) of a solution in one array, with zeros for strips beyond."""
    scalars = solution.power, solution.peak_pressure, float(solution.half_length.max())
    return np.concatenate(
        [
            [*scalars, solution.adhesion_fraction],
            *(np.pad(field, beyond) for field in (solution.line_load, solution.dissipation)),
        ]
    )


def _differences(values: FloatArray, reference: FloatArray) -> ContactErrors:
    """Return the differences of values from a reference, ordered as by `_values`."""
    count = len(_SCALARS)
    size = np.where(reference != 0.0, reference, 1.0)
    power, pressure, length = (values / size - 1.0)[: count - 1].tolist()
    strips, exact = (part[count:].reshape(2, -1)[1] for part in (values, reference))
    norms = [float(np.linalg.norm(part)) for part in (strips - exact, exact)]
    peaks = [float(np.abs(part).max()) for part in (strips - exact, exact)]
    return ContactErrors(
        norms[0] / (norms[1] or 1.0),
        peaks[0] / (peaks[1] or 1.0),
        power if reference[0] else float(values[0] != 0.0),
        pressure,
        length,
        float(values[count - 1] - reference[count - 1]),
    )


def _on(point: OperatingPoint, grid: Grid, other: Grid) -> OperatingPoint:
    """Return an operating point on other strips."""
    if other is grid:
        return point

    def moved(values: FloatArray) -> FloatArray:
        return np.interp(other.y, grid.y, values)

    variation, friction = point.creepage.variation, point.friction
    if variation is not None:
        point = replace(point, creepage=replace(point.creepage, variation=moved(variation)))
    if isinstance(friction, np.ndarray):
        point = replace(point, friction=moved(friction))
    return point
