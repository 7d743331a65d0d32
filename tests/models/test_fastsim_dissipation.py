"""Dissipation of FASTSIM: not negative in any strip, and in sum the work of the rigid slip."""

from dataclasses import replace

import numpy as np
import pytest
from hertz_fastsim_examples import CONTACTS, batch, draws

from tests.evolution import worn
from tests.materials import STEEL
from wearsim.models.contact.hertz import HertzModel, HertzOptions, strips_over_patch
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import Creepage, OperatingPoint

RIG, CIRCLE, SHORT = (90.0, 2.0), (20.0, 20.0), (2.0, 60.0)  # curvatures along and across [1/m]


def opposed(rng, count):
    """Return creepages from adhesion to sliding, and spins of any sign."""
    xi, eta = rng.normal(size=(2, count)) * 10.0 ** rng.uniform(-6.0, -2.5, (2, count))
    return xi, eta, rng.normal(size=count) * 10.0 ** rng.uniform(-2.0, 1.0, count)


@pytest.mark.parametrize("flexibility", ["three", "one"])
@pytest.mark.parametrize("curvatures", [RIG, CIRCLE, SHORT])
def test_no_strip_gains_energy_and_the_balance_holds(curvatures, flexibility):
    grid = strips_over_patch(HertzOptions(my=41), curvatures[1], curvatures[0], 300.0, (STEEL,) * 2)
    model = HertzModel(FastsimTheory(flexibility=flexibility), grid, (STEEL,) * 2)
    gap = 0.5 * curvatures[1] * grid.y**2
    for xi, eta, phi in zip(*opposed(np.random.default_rng(5), 150), strict=True):
        found = model.solve_one(
            gap, curvatures[0], OperatingPoint(300.0, 1.0, Creepage(xi, eta, phi), 0.1)
        )
        work = -(xi * found.force_x + eta * found.force_y + phi * found.spin_moment)
        assert found.dissipation.min() >= 0.0
        assert work > 0.0
        assert found.power == pytest.approx(work, rel=1e-9)
        assert found.dissipation.sum() * grid.spacing == pytest.approx(work, rel=1e-9)


@pytest.mark.parametrize("options", [{}, {"closed_form": "never"}, {"flexibility": "one"}])
def test_no_strip_of_a_batch_gains_energy(options):
    xi, eta, phi = opposed(np.random.default_rng(6), CONTACTS)
    points = replace(draws(), longitudinal=xi, lateral=eta, spin=phi)
    _, contacts, found = batch(points, **options)
    work = xi * found.force_x + eta * found.force_y + phi * found.spin_moment
    power = found.dissipation.sum(axis=-1) * (found.y[1] - found.y[0])
    assert found.dissipation.min() >= 0.0
    assert found.power == pytest.approx(-contacts.rolling_speed * work, rel=1e-9)
    assert power == pytest.approx(found.power, rel=1e-12)


def test_tilted_rollers_in_adhesion_wear_no_negative_depth():
    problem, state = worn(
        creepage__longitudinal=1e-4,
        roller__offset=["-1.269 mm", "-0.035 mm", "-0.862 mm"],
        creepage__tilt=["-1.469 mrad", "0.024 mrad", "1.14 mrad"],
        creepage__yaw=["-0.41 mrad", "0.538 mrad", "0.051 mrad"],
        wear__roller__k_over_h="3e-12 1/Pa",
        contact__model="hertz-fastsim",
        operation__duration="10 min",
    )
    assert problem.shape[1] == 3
    assert state.contacts.dissipation.min() >= 0.0
    assert state.stacked.min() >= 0.0
