"""FASTSIM, Kalker's simplified theory of rolling contact, on strips of any shape."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.jit import kernel
from wearsim.types import FloatArray


@kernel
def march(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    points: int,
) -> FloatArray:
    """March the traction from the leading to the trailing edge of every strip at once.

    A step of dx adds -gradient dx to the traction; where that exceeds the bound at the new point
    the traction is scaled back to it. Sums over the points are trapezoidal, as the traction
    vanishes at both edges; the work of the rigid slip follows from them without an error of its
    own, and is second order in dx.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        a(y) [m]; strips with a = 0 get zeros.
    bound_peak : ndarray, shape (strips,)
        Friction times the traction bound's pressure at x = 0 [Pa].
    elliptic : bool
        Whether the bound along the strip is sqrt(1 - x^2/a^2) rather than 1 - x^2/a^2.
    gradient_x : ndarray, shape (strips,)
        Rise of the longitudinal traction in adhesion, xi/L1 and spin's part over L3 [Pa/m].
    gradient_y, gradient_spin : float
        The same for the lateral traction, eta/L2 [Pa/m], and phi/L3 [Pa/m^2], which multiplies x.
    points : int
        Steps mx along each strip.

    Returns
    -------
    ndarray, shape (4, strips)
        Integral of the longitudinal and of the lateral traction [N/m], integral of x times the
        lateral traction [N], and length in adhesion [m].

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.
    """
    strips = len(half_length)
    out = np.zeros((4, strips))
    force_x, force_y, moment, adhesion = out[0], out[1], out[2], out[3]
    traction_x, traction_y = np.zeros(strips), np.zeros(strips)
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = 1.0 - cell * k if k < points else -1.0
        middle = place + 0.5 * cell
        shape = (1.0 - place) * (1.0 + place)
        if elliptic:
            shape = math.sqrt(shape)
        for j in range(strips):
            a = half_length[j]
            dx = cell * a
            tx = traction_x[j] - gradient_x[j] * dx
            ty = traction_y[j] - (gradient_y + gradient_spin * middle * a) * dx
            bound = shape * bound_peak[j]
            square = tx * tx + ty * ty
            sticks = square <= bound * bound
            scale = 1.0 if sticks else bound / math.sqrt(square)
            tx *= scale
            ty *= scale
            traction_x[j] = tx
            traction_y[j] = ty
            force_x[j] += tx
            force_y[j] += ty
            moment[j] += place * ty
            adhesion[j] += 1.0 if sticks else 0.0
    for j in range(strips):
        dx = cell * half_length[j]
        force_x[j] *= dx
        force_y[j] *= dx
        moment[j] *= dx * half_length[j]
        adhesion[j] *= dx
    return out


@kernel
def march_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    points: int,
) -> FloatArray:
    """March as `march` does, and keep what it passes.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y, gradient_spin, points
        As in `march`.

    Returns
    -------
    ndarray, shape (4, points + 1, strips)
        Longitudinal and lateral traction [Pa], and what the bound cut off each of them [Pa]; from
        the leading edge x = a to the trailing edge x = -a. Slip over the rolling velocity is
        ``-cut * L / dx`` in each direction, with its flexibility L.
    """
    strips = len(half_length)
    out = np.zeros((4, points + 1, strips))
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = 1.0 - cell * k if k < points else -1.0
        middle = place + 0.5 * cell
        shape = (1.0 - place) * (1.0 + place)
        if elliptic:
            shape = math.sqrt(shape)
        for j in range(strips):
            a = half_length[j]
            dx = cell * a
            tx = out[0, k - 1, j] - gradient_x[j] * dx
            ty = out[1, k - 1, j] - (gradient_y + gradient_spin * middle * a) * dx
            bound = shape * bound_peak[j]
            square = tx * tx + ty * ty
            scale = 1.0 if square <= bound * bound else bound / math.sqrt(square)
            out[0, k, j] = scale * tx
            out[1, k, j] = scale * ty
            out[2, k, j] = (1.0 - scale) * tx
            out[3, k, j] = (1.0 - scale) * ty
    return out


def element_sum(
    fields: FloatArray, longitudinal: float, lateral: float, rolling_speed: float
) -> FloatArray:
    """Return the textbook's dissipation: each element's new traction times its slip, added up.

    First order in dx, and low; kept to show what it costs against the work of the rigid slip.

    Parameters
    ----------
    fields : ndarray, shape (4, points + 1, strips)
        As `march_fields` returns them.
    longitudinal, lateral : float
        Flexibilities L1 and L2 [m/Pa].
    rolling_speed : float
        V [m/s].

    Returns
    -------
    ndarray, shape (strips,)
        P_l [W/m].
    """
    traction_x, traction_y, cut_x, cut_y = fields
    work = longitudinal * traction_x * cut_x + lateral * traction_y * cut_y
    return np.asarray(rolling_speed * work.sum(axis=0))


def closed_form(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
) -> FloatArray:
    """Return what `march` tends to without spin, where each traction keeps one direction.

    With G = |gradient| the traction climbs as G s behind the leading edge until it meets the bound,
    where it stays: at s = 2a - kappa, kappa = G a^2/bound_peak, for the parabolic bound, and at
    s = 2a/(1 + k^2), k = G a/bound_peak, for the elliptic one.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y
        As in `march`.

    Returns
    -------
    ndarray, shape (4, strips)
        As `march` returns, the moment being that of the same tractions.

    Notes
    -----
    Integrated here from the march of Kalker (1982), DOI 10.1080/00423118208968684.
    """
    size = np.hypot(gradient_x, gradient_y)
    inside = (half_length > 0.0) & (size > 0.0) & (bound_peak > 0.0)
    a = np.where(inside, half_length, 1.0)
    steep = np.where(inside, size, 1.0)
    peak = np.where(inside, bound_peak, 1.0)
    stick, force, moment = (_elliptic if elliptic else _parabolic)(a, steep, peak)
    idle = (half_length > 0.0) & (size == 0.0)
    adhesion = np.where(inside, stick, np.where(idle, 2.0 * half_length, 0.0))
    toward_x = np.where(inside, -gradient_x / steep, 0.0)
    toward_y = np.where(inside, -gradient_y / steep, 0.0)
    return np.stack([force * toward_x, force * toward_y, moment * toward_y, adhesion])


def _parabolic(
    a: FloatArray, steep: FloatArray, peak: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return adhesion length, force and moment (x times traction) for the parabolic bound."""
    kappa = np.minimum(steep * a**2 / peak, 2.0 * a)
    stick = 2.0 * a - kappa
    # x = a - s; in adhesion the traction is G s, in slip peak s(2a - s)/a^2
    slip_force = peak * kappa**2 * (3.0 * a - kappa) / (3.0 * a**2)
    edge = kappa - a  # x where slip starts
    slip_moment = -0.25 * peak * (a**2 - edge**2) ** 2 / a**2
    force = 0.5 * steep * stick**2 + slip_force
    moment = steep * stick**2 * (0.5 * a - stick / 3.0) + slip_moment
    return stick, force, moment


def _elliptic(
    a: FloatArray, steep: FloatArray, peak: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return adhesion length, force and moment (x times traction) for the elliptic bound."""
    k = steep * a / peak
    stick = 2.0 * a / (1.0 + k**2)
    cosine = (k**2 - 1.0) / (k**2 + 1.0)  # x/a where slip starts
    sine = 2.0 * k / (1.0 + k**2)
    slip_force = 0.5 * peak * a * (cosine * sine + np.arctan2(cosine, sine) + 0.5 * np.pi)
    slip_moment = -peak * a**2 * sine**3 / 3.0
    force = 0.5 * steep * stick**2 + slip_force
    moment = steep * stick**2 * (0.5 * a - stick / 3.0) + slip_moment
    return stick, force, moment


def closed_form_parabolic(
    semi_axis_x: float,
    semi_axis_y: float,
    normal_force: float,
    friction: float,
    creepage: float,
    flexibility: float,
    half_length: FloatArray,
) -> FloatArray:
    """Return the force per strip of Kalker's ellipse under one creepage, in closed form.

    With kappa = v a^2/(L mu pp), pp = 2N/(pi a b), the same for every strip of half-length A:
    F = (v/L)(2 A^2 - A kappa + kappa^2/6) where kappa < 2A, else (4/3) mu pp A^3/a^2. The
    dissipation is V v F.

    Parameters
    ----------
    semi_axis_x, semi_axis_y : float
        a and b [m].
    normal_force : float
        N [N].
    friction : float
        mu.
    creepage : float
        Magnitude v of the creepage.
    flexibility : float
        L of its direction [m/Pa].
    half_length : ndarray, shape (strips,)
        A = a(y) [m].

    Returns
    -------
    ndarray, shape (strips,)
        Magnitude of the force per unit of axial length [N/m].
    """
    peak = friction * 2.0 * normal_force / (math.pi * semi_axis_x * semi_axis_y)
    bound_peak = peak * (half_length / semi_axis_x) ** 2
    gradient = np.full_like(half_length, creepage / flexibility)
    force_x: FloatArray = closed_form(half_length, bound_peak, False, gradient, 0.0)[0]
    return -force_x
