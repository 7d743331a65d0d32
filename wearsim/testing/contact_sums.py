"""What the strips of any solved contact must add up to, whatever the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.testing.checks import Checks, agree, require
from wearsim.testing.contact_bench import NUMBERS, STRIPS, ContactBench
from wearsim.types import ContactSolution, Creepage

SUMS: Checks[ContactBench] = Checks()
_SOLUTION = "wearsim.types.ContactSolution"
_MODEL = "wearsim.plugins.ContactModel"
_SATURATED = 0.02  # how much may be missing of mu N in gross sliding


def sliding(bench: ContactBench) -> ContactSolution:
    """Return the contact in gross sliding along rolling."""
    return bench.solve(bench.point(Creepage(0.1)))


@SUMS.promised_in(_SOLUTION)
def solution_is_whole_and_finite(bench: ContactBench) -> None:
    """Every field of a solution has its shape and is finite, on the strips that were given."""
    for what, (_, found) in bench.solutions.items():
        for name in STRIPS:
            values = np.asarray(getattr(found, name))
            told = f"{what}: {name} has the shape {values.shape}, not {bench.grid.y.shape}"
            require(values.shape == bench.grid.y.shape, told)
            require(bool(np.isfinite(values).all()), f"{what}: {name} is not finite")
        for name in NUMBERS:
            value = getattr(found, name)
            require(np.ndim(value) == 0, f"{what}: {name} is not one number")
            require(bool(np.isfinite(value)), f"{what}: {name} is {value}")
        agree(f"{what}: y", found.y, bench.grid.y, 0.0)


@SUMS.promised_in(_SOLUTION)
def strips_carry_the_load(bench: ContactBench) -> None:
    """The line loads add up to the normal force."""
    for what, (point, found) in bench.solutions.items():
        carried = float(found.line_load.sum()) * bench.grid.spacing
        agree(f"{what}: load of the strips", carried, point.normal_force, bench.case.tolerance)


@SUMS.promised_in(_SOLUTION)
def nothing_outside_the_contact(bench: ContactBench) -> None:
    """Half-length, line load and dissipation are never negative, and zero outside the contact."""
    for what, (_, found) in bench.solutions.items():
        outside = found.half_length <= 0.0
        require(bool(outside[[0, -1]].all()), f"{what}: the first or last strip is in contact")
        for name in STRIPS:
            values = getattr(found, name)
            require(float(values.min()) >= 0.0, f"{what}: {name} falls to {values.min():.3g}")
            most = float(np.abs(values[outside]).max())
            require(most == 0.0, f"{what}: {name} is {most:.3g} where half_length is 0")
        loaded = found.line_load[~outside]
        require(bool((loaded > 0.0).all()), f"{what}: a strip with a half_length carries no load")


@SUMS.promised_in(_SOLUTION)
def power_is_the_sum_over_the_strips(bench: ContactBench) -> None:
    """The power is the sum of the dissipation over the strips."""
    for what, (_, found) in bench.solutions.items():
        total = float(found.dissipation.sum()) * bench.grid.spacing
        agree(f"{what}: power", found.power, total, bench.case.tolerance)


@SUMS.promised_in(_MODEL)
def power_is_the_work_of_the_rigid_slip(bench: ContactBench) -> None:
    """P = -V (xi F_x + eta F_y + phi M_z), whatever the creepages."""
    for what, (point, found) in bench.solutions.items():
        creepage, speed = point.creepage, point.rolling_speed
        parts = speed * np.array(
            [
                found.longitudinal_creepage * found.force_x,
                creepage.lateral * found.force_y,
                creepage.spin * found.spin_moment,
            ]
        )
        size = float(np.abs(parts).sum())
        told = f"{what}: power, against -V (xi F_x + eta F_y + phi M_z),"
        agree(told, found.power, -float(parts.sum()), bench.case.tolerance, size)


@SUMS.promised_in("wearsim.types.Creepage")
def creepage_is_the_mean_that_was_asked(bench: ContactBench) -> None:
    """Without a bearing torque the mean longitudinal creepage is the one that was asked."""
    for what, (point, found) in bench.solutions.items():
        asked = point.creepage.longitudinal
        agree(f"{what}: longitudinal_creepage", found.longitudinal_creepage, asked, 1e-12)


@SUMS.promised_in("wearsim.types.OperatingPoint")
def forces_obey_coulomb(bench: ContactBench) -> None:
    """The tangential force never exceeds mu N, and reaches it in gross sliding."""
    case = bench.case
    most = case.friction * case.normal_force
    for what, (_, found) in bench.solutions.items():
        force = float(np.hypot(found.force_x, found.force_y))
        told = f"{what}: the tangential force is {force:.6g} N, beyond mu N = {most:.6g} N"
        # a march over points sums tractions that it bounds point by point
        require(force <= most * (1.0 + 1e-3), told)
    agree("the force at a creepage of 0.1", sliding(bench).force_x, -most, _SATURATED)


@SUMS.promised_in(_SOLUTION)
def gross_sliding_leaves_no_adhesion(bench: ContactBench) -> None:
    """The part of the area that adheres lies between 0 and 1, and is none in gross sliding."""
    for what, (_, found) in bench.solutions.items():
        share = found.adhesion_fraction
        require(0.0 <= share <= 1.0, f"{what}: adhesion_fraction is {share:.3g}")
    # Carter: a strip that lacks a part s of its friction adheres over sqrt(s) of its length
    share, most = sliding(bench).adhesion_fraction, _SATURATED**0.5
    told = f"adhesion_fraction at a creepage of 0.1 is {share:.3g}, and {most:.2g} is allowed"
    require(share <= most, told)


@SUMS.promised_in(_SOLUTION)
def peak_pressure_is_no_less_than_a_mean(bench: ContactBench) -> None:
    """The peak pressure is at least the mean pressure q/(2 a) of every strip."""
    for what, (_, found) in bench.solutions.items():
        inside = found.half_length > 0.0
        mean = float((found.line_load[inside] / (2.0 * found.half_length[inside])).max())
        told = f"{what}: peak_pressure is {found.peak_pressure:.6g} Pa, a strip's mean {mean:.6g}"
        require(found.peak_pressure >= mean * (1.0 - bench.case.tolerance), told)


@SUMS.promised_in(_MODEL)
def no_creepage_no_power(bench: ContactBench) -> None:
    """Bodies that roll without creepage exchange no force and dissipate nothing."""
    found = bench.solve(bench.point(Creepage(0.0)))
    force = bench.case.friction * bench.case.normal_force
    agree("power without creepage", found.power, 0.0, 1e-9, bench.sliding_power)
    agree("force_x without creepage", found.force_x, 0.0, 1e-9, force)
    agree("force_y without creepage", found.force_y, 0.0, 1e-9, force)


@SUMS.promised_in(_MODEL)
def mirror_image_has_the_mirrored_answer(bench: ContactBench) -> None:
    """With gap, lateral creepage and spin mirrored in y, the answer is mirrored."""
    tolerance = bench.case.tolerance
    for what, gap in bench.gaps.items():
        point = bench.point(Creepage(3e-4, 4e-4, 0.3))
        turned = replace(point, creepage=Creepage(3e-4, -4e-4, -0.3))
        found, image = bench.solve(point, gap), bench.solve(turned, gap[::-1].copy())
        for name in STRIPS:
            agree(f"{what}: mirrored {name}", getattr(image, name)[::-1], getattr(found, name),
                  tolerance)  # fmt: skip
        for name, sign in (("force_x", 1.0), ("force_y", -1.0), ("spin_moment", -1.0)):
            arm = bench.case.width if name == "spin_moment" else 1.0
            size = bench.case.friction * bench.case.normal_force * arm
            agree(f"{what}: mirrored {name}", getattr(image, name), sign * getattr(found, name),
                  tolerance, size)  # fmt: skip


@SUMS.promised_in("wearsim.plugins.ContactModel.solve")
def zero_of_the_gap_is_arbitrary(bench: ContactBench) -> None:
    """A constant added to the gap is added to the approach and changes nothing else."""
    first = bench.solution
    for part in (0.25, -2.0):
        shift = part * float(np.ptp(bench.gap))
        found = bench.solve(gap=bench.gap + shift)
        told = f"after {shift:.3g} m were added to the gap"
        agree(f"the approach {told}", found.approach, first.approach + shift, 1e-6)
        agree(f"the line load {told}", found.line_load, first.line_load, 1e-5)
    deepest = float(bench.gap.min())
    require(first.approach > deepest, "the approach lies above the least gap: nothing is pressed")


@SUMS.promised_in(_SOLUTION)
def approach_rises_with_load(bench: ContactBench) -> None:
    """The approach rises with the load, and the peak pressure does not fall."""
    loads = bench.case.normal_force * np.array([0.5, 0.75, 1.0, 1.25])
    found = [bench.solve(bench.point(normal_force=float(load))) for load in loads]
    for name, least in (("approach", 1e-12), ("peak_pressure", -1e-9)):
        values = np.array([getattr(item, name) for item in found])
        told = f"{name} at loads of {loads} N is {values}"
        require(bool((np.diff(values) > least * np.abs(values[1:])).all()), told)


@SUMS.promised_in("wearsim.types.Grid")
def answers_settle_as_strips_are_refined(bench: ContactBench) -> None:
    """Doubling the strips twice changes the answer less the second time."""
    case = bench.case
    point = bench.point(Creepage(3e-4, 4e-4, 0.3))
    found = []
    for times in (1, 2, 4):
        grid = case.grid(times)
        found.append(bench.fresh(grid).solve(case.gap(grid), case.curvature, point))
    for name in ("approach", "peak_pressure", "power", "force_x", "force_y"):
        coarse, middle, fine = (getattr(item, name) for item in found)
        before, after, noise = abs(middle - coarse), abs(fine - middle), 2e-3 * abs(fine)
        told = (
            f"{name} is {coarse:.6g}, {middle:.6g} and {fine:.6g} with {case.strips},"
            f" {2 * case.strips} and {4 * case.strips} strips: it does not settle"
        )
        require(after <= 0.75 * before + noise, told)
        require(abs(fine - coarse) <= 0.1 * abs(fine), told)
