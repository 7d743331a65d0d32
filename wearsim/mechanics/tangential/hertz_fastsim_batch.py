"""Batches of contacts with Hertz patches and FASTSIM, solved one after another."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.hertz.parabola_fit import CONVERGED
from wearsim.mechanics.hertz.patches import Bodies, Patches, cut_into_strips, find_patches
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.mechanics.tangential.fastsim import (
    ADHESION,
    FORCE_X,
    FORCE_Y,
    MOMENT,
    ROWS,
    TRACTION_X,
    WORK,
    closed_form_into,
    march_into,
)
from wearsim.mechanics.tangential.kalker_coefficients import (
    CreepageCoefficients,
    Spline,
    coefficient,
    flexibilities,
    one_flexibility,
    short_limit,
)
from wearsim.types import FloatArray, IntArray

NEVER, EXACT, ALWAYS = range(3)  # use of the closed form instead of `march`
TABLE, LINE_LIMIT, GIVEN = range(3)  # source of Kalker's coefficients
NO_LIMIT, NOT_FINITE = 30, 31  # statuses in addition to those of `hertz.patches`
_LANES = 4  # strips per vector operation of `march`; a remaining strip costs as much as four


class Theory(NamedTuple):
    """Options of the tangential theory; see `models.tangential.fastsim.FastsimTheory`.

    G [Pa], nu, whether the bound is elliptic, use of the closed form, whether the dissipation is
    the element sum, steps along a strip, whether a single flexibility is used, source of the
    creepage coefficients, given coefficients (3,) and the tables of C11, C22 and C23.
    """

    shear_modulus: float
    poisson_ratio: float
    elliptic: bool
    closed_form: int
    element_sum: bool
    points: int
    single: bool
    kalker: int
    given: FloatArray
    tables: tuple[Spline, Spline, Spline]


class ContactInputs(NamedTuple):
    """Operating points of the contacts.

    Loads [N], creepages, spins [1/m] and V [m/s], all (contacts,); friction (contacts, points,
    strips), with one point if constant along a strip, and one strip if equal for all; whether
    friction moves with the material; variation of the creepage (contacts, strips), or (0, strips)
    for none; lever arm of the longitudinal traction (contacts, strips) [m], or (0, strips) where
    the torque on the roller is not needed.
    """

    normal_force: FloatArray
    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray
    friction: FloatArray
    carried: bool
    variation: FloatArray
    rolling_speed: FloatArray
    rolling_radius: FloatArray


class ContactResults(NamedTuple):
    """Solution: a(y) [m], q(y) [N/m] and P_l [W/m] (contacts, strips), the others (contacts,).

    Forces [N] and spin moment [N m] on body 1, adhering fraction of the area, power [W] and torque
    on the roller [N m].
    """

    half_length: FloatArray
    line_load: FloatArray
    dissipation: FloatArray
    force_x: FloatArray
    force_y: FloatArray
    spin_moment: FloatArray
    adhesion_fraction: FloatArray
    power: FloatArray
    torque: FloatArray


class Workspace(NamedTuple):
    """Work space of one contact: coverage and slip of all strips, and the inputs of `march`.

    Half-lengths, gradients and bounds begin at the first strip in contact, and their size is a
    multiple of `_LANES`.
    """

    middle: FloatArray
    coverage: FloatArray
    longitudinal: FloatArray
    spin_part: FloatArray
    peak: FloatArray
    half_length: FloatArray
    gradient_x: FloatArray
    bound: FloatArray


@kernel
def solve_contacts(
    bodies: Bodies,
    theory: Theory,
    gaps: FloatArray,
    row: IntArray,
    inputs: ContactInputs,
    patches: Patches,
    results: ContactResults,
) -> int:
    """Solve every contact; the result does not depend on the order or on the batch.

    Parameters
    ----------
    bodies, theory : Bodies, Theory
        Constants of the contacts, and options.
    gaps : ndarray, shape (rows, strips)
        Gaps [m].
    row : ndarray of int, shape (contacts,)
        The row of each contact's gap.
    inputs : ContactInputs
        Loads, creepage and friction.
    patches, results : Patches, ContactResults
        Overwritten; of a contact that failed only `patches.status` is valid.

    Returns
    -------
    int
        The first contact that failed, or their number.
    """
    strips = len(bodies.y)
    rows, lanes = np.empty((5, strips)), np.empty((3, _whole_lanes(strips)))
    work = Workspace(rows[0], rows[1], rows[2], rows[3], rows[4], lanes[0], lanes[1], lanes[2])
    total, sums = np.empty((ROWS, strips)), np.empty((ROWS, _whole_lanes(strips)))
    ones = np.ones((theory.points, strips))
    given = theory.given
    find_patches(bodies, gaps, row, inputs.normal_force, patches)
    last_ratio, last = math.nan, CreepageCoefficients(math.nan, math.nan, math.nan, math.nan)
    for k in range(len(row)):
        if patches.status[k] != CONVERGED:
            return k
        a, b, ratio = patches.a[k], patches.b[k], patches.ratio[k]
        if theory.kalker == GIVEN:
            last = CreepageCoefficients(given[0], given[1], given[2], math.nan)
        elif ratio != last_ratio:
            last_ratio, last = ratio, _coefficients(theory, ratio)
        if not last.c23 > 0.0:
            patches.status[k] = NO_LIMIT
            return k
        first, stop = cut_into_strips(
            bodies,
            a,
            b,
            patches.centre[k],
            inputs.normal_force[k],
            results.half_length[k],
            results.line_load[k],
            work.middle,
            work.coverage,
        )
        _fill_creepage(k, bodies, inputs, results.line_load[k], work)
        _solve_tractions(
            k, first, stop, last, theory, inputs, patches, results, work, ones, sums, total
        )
        _fill_results(k, bodies, theory, inputs, results, work, total)
        if not math.isfinite(results.power[k]):
            patches.status[k] = NOT_FINITE
            return k
    return len(row)


@subroutine
def _coefficients(theory: Theory, ratio: float) -> CreepageCoefficients:
    """Return C11, C22 and C23 at a/b = `ratio`; C33, which is not used, is nan."""
    nu = theory.poisson_ratio
    if theory.kalker == LINE_LIMIT:
        c11, c22, c23, _ = short_limit(ratio, nu)
        return CreepageCoefficients(c11, c22, c23, math.nan)
    values = (math.nan, math.nan, math.nan)
    for which in range(3):
        values = values[1], values[2], coefficient(which, ratio, nu, theory.tables[which])
    return CreepageCoefficients(values[0], values[1], values[2], math.nan)


@subroutine
def _load_weighted_mean(values: FloatArray, line_load: FloatArray) -> float:
    """Return the mean of the values of the strips, weighted by their loads."""
    product, load = 0.0, 0.0
    for j in range(len(line_load)):
        product += values[j] * line_load[j]
        load += line_load[j]
    return product / load


@subroutine
def _fill_creepage(
    k: int, bodies: Bodies, inputs: ContactInputs, line_load: FloatArray, work: Workspace
) -> None:
    """Fill the longitudinal creepage of the strips, as defined by `Creepage`."""
    strips, mean = len(bodies.y), inputs.longitudinal[k]
    work.longitudinal[:] = mean
    work.spin_part[:] = 0.0
    if len(inputs.variation) > 0:
        shift = _load_weighted_mean(inputs.variation[k], line_load)
        for j in range(strips):
            work.longitudinal[j] = mean + (inputs.variation[k, j] - shift)
    elif inputs.spin[k] != 0.0:
        for j in range(strips):
            work.spin_part[j] = -inputs.spin[k] * bodies.y[j]
        shift = _load_weighted_mean(work.spin_part, line_load)
        for j in range(strips):
            work.spin_part[j] -= shift
            work.longitudinal[j] = mean + work.spin_part[j]


@subroutine
def _solve_tractions(
    k: int,
    first: int,
    stop: int,
    coefficients: CreepageCoefficients,
    theory: Theory,
    inputs: ContactInputs,
    patches: Patches,
    results: ContactResults,
    work: Workspace,
    ones: FloatArray,
    sums: FloatArray,
    total: FloatArray,
) -> None:
    """Integrate the tractions of contact `k` along its strips into `total`."""
    a, b = patches.a[k], patches.b[k]
    longitudinal, lateral, turning = flexibilities(coefficients, a, b, theory.shear_modulus)
    if theory.single:
        for j in range(len(work.peak)):
            work.gradient_x[j] = abs(work.longitudinal[j] - work.spin_part[j])
        along = _load_weighted_mean(work.gradient_x, results.line_load[k])
        spinning = inputs.spin[k] * math.sqrt(a * b)
        longitudinal = one_flexibility(
            longitudinal, lateral, turning, along, inputs.lateral[k], spinning
        )
        lateral, turning = longitudinal, longitudinal
    parabola = 2.0 * inputs.normal_force[k] / (math.pi * a * b)
    for j in range(len(work.peak)):
        t = work.middle[j] / b
        section = max((1.0 - t) * (1.0 + t), 0.0) if work.coverage[j] > 0.0 else 0.0
        elliptic_peak = patches.peak_pressure[k] * math.sqrt(section)
        work.peak[j] = elliptic_peak if theory.elliptic else parabola * section
    count, whole = stop - first, _whole_lanes(stop - first)
    for j in range(count):
        here = first + j
        mean = work.longitudinal[here] - work.spin_part[here]
        work.gradient_x[j] = mean / longitudinal + work.spin_part[here] / turning
        work.half_length[j] = results.half_length[k, here]
        work.bound[j] = work.peak[here]
    for j in range(count, whole):  # padding by strips of zero length
        work.gradient_x[j] = work.half_length[j] = work.bound[j] = 0.0
    gradient_y, gradient_spin = inputs.lateral[k] / lateral, inputs.spin[k] / turning
    half_length, gradient_x, bound = work.half_length, work.gradient_x, work.bound
    friction = inputs.friction[k]
    lanes, columns = friction.shape
    total[:] = 0.0
    if lanes > 1 and not inputs.carried:
        march_into(
            count,
            half_length,
            bound,
            friction,
            first,
            theory.elliptic,
            gradient_x,
            gradient_y,
            gradient_spin,
            longitudinal,
            lateral,
            lanes,
            sums,
            None,
        )
        _accumulate(count, sums, 1.0, first, total)
        return
    closed = theory.closed_form == ALWAYS
    closed = closed or (theory.closed_form == EXACT and inputs.spin[k] == 0.0)
    for lane in range(lanes):  # the material points of a friction field that moves, or one for all
        for j in range(count):
            bound[j] = friction[lane, first + j if columns > 1 else 0] * work.peak[first + j]
        if theory.element_sum:
            march_into(
                count,
                half_length,
                bound,
                ones,
                first,
                theory.elliptic,
                gradient_x,
                gradient_y,
                gradient_spin,
                longitudinal,
                lateral,
                theory.points,
                sums,
                None,
            )
        elif closed:
            closed_form_into(
                count, half_length, bound, theory.elliptic, gradient_x, gradient_y, sums
            )
            if inputs.spin[k] != 0.0:
                for j in range(count):
                    sums[MOMENT, j] = 0.0  # phi x is neglected in the work and in the traction
        else:
            march_into(
                whole,
                half_length,
                bound,
                None,
                0,
                theory.elliptic,
                gradient_x,
                gradient_y,
                gradient_spin,
                longitudinal,
                lateral,
                theory.points,
                sums,
                None,
            )
        _accumulate(count, sums, 1.0 / lanes, first, total)


@subroutine
def _whole_lanes(strips: int) -> int:
    """Return the number of strips rounded up to a multiple of `_LANES`."""
    return (strips + _LANES - 1) // _LANES * _LANES


@subroutine
def _accumulate(count: int, part: FloatArray, weight: float, first: int, total: FloatArray) -> None:
    """Add the weighted integrals of the strips from `first` on to the totals."""
    for row in range(TRACTION_X):
        for j in range(count):
            total[row, first + j] += weight * part[row, j]


@subroutine
def _fill_results(
    k: int,
    bodies: Bodies,
    theory: Theory,
    inputs: ContactInputs,
    results: ContactResults,
    work: Workspace,
    total: FloatArray,
) -> None:
    """Fill the solution of contact `k` from the integrals along its strips."""
    eta, phi, speed = inputs.lateral[k], inputs.spin[k], inputs.rolling_speed[k]
    centre = _load_weighted_mean(bodies.y, results.line_load[k])
    force_x, force_y, moment, power, sticking, length = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    positive, torque = 0.0, 0.0
    for j in range(len(bodies.y)):
        part = work.coverage[j]
        tx, ty, turning = total[FORCE_X, j], total[FORCE_Y, j], total[MOMENT, j]
        rigid_work = work.longitudinal[j] * tx + eta * ty + phi * turning
        dissipation = part * (speed * total[WORK, j] if theory.element_sum else -speed * rigid_work)
        results.dissipation[k, j] = dissipation
        power += dissipation
        positive += max(dissipation, 0.0)
        force_x += part * tx
        if len(inputs.rolling_radius) > 0:
            torque -= part * tx * inputs.rolling_radius[k, j]
        force_y += part * ty
        moment += part * turning - (bodies.y[j] - centre) * (part * tx)
        sticking += total[ADHESION, j]
        length += results.half_length[k, j]
    if positive > power:  # as of `spread_work`, with the work of three flexibilities
        power = max(power, 0.0)
        for j in range(len(bodies.y)):
            results.dissipation[k, j] = max(results.dissipation[k, j], 0.0) * (power / positive)
    results.force_x[k], results.force_y[k] = force_x * bodies.spacing, force_y * bodies.spacing
    results.spin_moment[k], results.power[k] = moment * bodies.spacing, power * bodies.spacing
    results.adhesion_fraction[k] = sticking / (2.0 * length)
    results.torque[k] = torque * bodies.spacing
