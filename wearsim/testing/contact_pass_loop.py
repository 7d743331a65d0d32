"""The compiled per-pass loop of a contact model: the same as its single solves, one by one."""

from __future__ import annotations

import numpy as np

from wearsim.plugins import PassLoop
from wearsim.testing.checks import Checks, agree, require
from wearsim.testing.contact_bench import ContactBench
from wearsim.testing.contact_capabilities import refuses
from wearsim.types import Creepage

PASS_LOOP: Checks[ContactBench] = Checks()
_PASSES = 12


def _loop(bench: ContactBench) -> PassLoop:
    """Return two rollers that take turns, with a spring, a lagging term, tilt and spin."""
    case, y, shape = bench.case, bench.grid.y, (2, bench.grid.strips)
    pressed = bench.solution.approach - float(bench.gap.min())
    # every pass wears a part in ten thousand of the approach where the dissipation is greatest
    factor = 1e-4 * pressed * case.rolling_speed / float(bench.solution.dissipation.max())
    turns = np.linspace(-1.0, 1.0, _PASSES)
    return PassLoop(
        order=np.array([0, 1]),
        first_pass=4,
        base_load=case.normal_force * (1.0 + 0.05 * turns),
        creepage=np.stack([1e-3 * (1.0 + 0.1 * turns), 2e-4 * turns], axis=1),
        friction=case.friction * (1.0 - 0.1 * turns),
        tilt=1e-5 * turns,
        spin=0.05 * turns,
        stiffness=0.1 * case.normal_force / pressed,
        nominal_gap=np.array([bench.gaps["fresh"], bench.gaps["off centre"]]),
        from_apex=np.array([y, y - 0.05 * case.width]),
        longitudinal_curvature=case.curvature,
        rolling_speed=case.rolling_speed,
        slip_base=np.zeros(shape),
        spin_arm=np.array([y, y]),
        slip_rates=np.zeros(2),
        wear=factor * np.array([1.0, 0.5, 0.0]),
        term_rates=np.array([[20.0, 0.1, 0.2]]),
        similar=False,
        terms=np.array([[0.5, 1.0]]),
        cylinder_depth=np.zeros(bench.grid.strips),
        roller_depth=np.zeros(shape),
        line_load=np.zeros(shape),
        anchor=np.zeros(shape),
        anchor_gap=np.zeros(shape),
        approach=np.zeros(2),
        anchor_approach=np.zeros(2),
        energy=np.zeros(2),
    )


def _one_by_one(bench: ContactBench, loop: PassLoop) -> None:
    """Run the passes of `loop` by single solves, as `PassLoop` describes them."""
    for p in range(_PASSES):
        g = int(loop.order[(loop.first_pass + p) % len(loop.order)])
        unworn = loop.nominal_gap[g] + loop.tilt[p] * loop.from_apex[g]
        gap = unworn + loop.cylinder_depth + loop.roller_depth[g]
        descent = float(gap.min() - unworn.min())
        load = float(loop.base_load[p] + loop.terms[:, g].sum() - loop.stiffness * descent)
        longitudinal, lateral = loop.creepage[p].tolist()
        point = bench.point(
            Creepage(longitudinal, lateral, float(loop.spin[p])),
            normal_force=load,
            friction=float(loop.friction[p]),
        )
        found = bench.solve(point, gap)
        rubbed = found.dissipation / loop.rolling_speed
        loop.cylinder_depth += loop.wear[0] * rubbed
        loop.roller_depth[g] += loop.wear[1 + g] * rubbed
        gain, rate = loop.term_rates[:, 0], loop.term_rates[:, 1 + g]
        loop.terms[:, g] += rate * (gain * found.power - loop.terms[:, g])
        loop.energy[g] += found.power
        loop.line_load[g], loop.approach[g] = found.line_load, found.approach


@PASS_LOOP.promised_in("wearsim.plugins.PassLoop")
def pass_loop(bench: ContactBench) -> None:
    """Passes in the compiled loop leave behind what single solves do."""
    if refuses(bench, "pass_loop", lambda: bench.model.pass_loop(_loop(bench))):
        return
    fast, slow = _loop(bench), _loop(bench)
    full = bench.model.pass_loop(fast)
    _one_by_one(bench, slow)
    require(0 < full <= _PASSES, f"pass_loop says that {full} of {_PASSES} passes were solved")
    for name in ("cylinder_depth", "roller_depth", "line_load", "approach", "energy", "terms"):
        told = f"{name} after {_PASSES} passes in the loop, against single solves,"
        agree(told, getattr(fast, name), getattr(slow, name), 1e-5)
