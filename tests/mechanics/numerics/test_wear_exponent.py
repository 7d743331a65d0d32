"""Wear over line load, and the exponent between them."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.wear_exponent import estimate_exponents, ratio_to_load


def test_ratio_is_extended_to_strips_without_load():
    load = np.array([[0.0, 2.0, 0.0, 0.0, 4.0, 0.0]])
    wear = np.array([[0.0, 4.0, 0.0, 0.0, 20.0, 0.0]])
    assert ratio_to_load(wear, load)[0] == pytest.approx([2.0, 2.0, 3.0, 4.0, 5.0, 5.0])


def test_contact_without_load_has_zero_ratio():
    assert not ratio_to_load(np.zeros((2, 3)), np.zeros((2, 3))).any()


def test_exponent_of_a_power_law_is_estimated():
    load, new = np.array([[1.0, 2.0, 3.0, 0.0]]), np.array([[1.5, 1.0, 3.0, 0.0]])
    exponents = np.full((1, 4), 0.9)
    estimate_exponents(load, new, load**0.7, new**0.7, 1.0, exponents)
    # no estimate in a strip of constant load, nor in one without load
    assert exponents[0] == pytest.approx([0.7, 0.7, 0.9, 0.9])


def test_exponents_are_limited_to_their_bounds():
    exponents = np.ones((1, 2))
    load, new = np.array([[1.0, 1.0]]), np.array([[2.0, 2.0]])
    estimate_exponents(load, new, load, new ** np.array([[3.0, 0.1]]), 1.0, exponents)
    assert exponents[0].tolist() == [1.0, 0.4]
