"""Contacts of the rig for tests of `hertz-fastsim`, single and in batches."""

import math
from dataclasses import replace

import numpy as np

from tests.materials import STEEL
from wearsim.contact_batch import ContactBatch
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.models.contact.hertz_fastsim import SPEC, HertzFastsim, HertzFastsimOptions
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
PAIR = combine(*MATERIALS)
SPEED = 1000.0 * 2.0 * math.pi / 60.0 * 25e-3
RIG = (90.0, 2.0)  # relative curvatures along and across


def contact(grid=None, creepage=(1e-3, 0.0, 0.0), load=300.0, mu=0.1, shape=None, **options):
    """Solve the rig's contact; `options` as in a scenario."""
    chosen = HertzFastsimOptions(**options)
    if grid is None:
        grid = SPEC.suggest_grid(chosen, RIG[1], RIG[0], load, MATERIALS)
    model = HertzFastsim(chosen, grid, MATERIALS)
    gap = grid.y**2 if shape is None else shape(grid.y)
    point = OperatingPoint(load, SPEED, Creepage(*creepage), mu)
    return model, gap, point, model.solve_one(gap, RIG[0], point)


def balance(point, solution):
    creepage = point.creepage
    return -point.rolling_speed * (
        solution.longitudinal_creepage * solution.force_x
        + creepage.lateral * solution.force_y
        + creepage.spin * solution.spin_moment
    )


def groove(depth, offset=0.0):
    return lambda y: y**2 + 0.95 * np.maximum(depth - (y - offset) ** 2, 0.0)


CONTACTS = 60


def draws(contacts=CONTACTS, seed=0, half=3e-3, strips=50):
    """Return contacts as in the paper: random load, creepage, yaw, tilt and friction."""
    random = np.random.default_rng(seed)
    radius, angle = 2e-3 * np.sqrt(random.random(contacts)), 2 * np.pi * random.random(contacts)
    return ContactBatch(
        gap=np.broadcast_to(Grid.spanning(-half, half, strips).y ** 2, (contacts, strips)),
        longitudinal_curvature=np.full(contacts, RIG[0]),
        normal_force=random.normal(307.0, 32.0, contacts),
        longitudinal=np.abs(random.normal(1e-3, 4e-4, contacts)),
        lateral=radius * np.cos(angle),
        spin=radius * np.sin(angle) / 20e-3,
        friction=np.abs(random.normal(0.1, 0.02, contacts)),
        rolling_speed=np.full(contacts, SPEED),
    )


def batch(contacts, shape=None, half=3e-3, strips=50, **options):
    """Solve a batch of contacts, on one gap or on several; return model, batch and solution."""
    grid = Grid.spanning(-half, half, strips)
    model = HertzFastsim(HertzFastsimOptions(**options), grid, MATERIALS)
    gap = np.broadcast_to(grid.y**2, (len(contacts), strips))
    if shape is not None:
        gap = np.array([shape(grid.y, k) for k in range(len(contacts))])
    contacts = replace(contacts, gap=gap)
    return model, contacts, model.solve(contacts)
