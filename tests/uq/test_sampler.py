"""Sampler: independence of draws from their context, and invalid input."""

import numpy as np
import pytest

from wearsim.uq.sampling.sampler import PLANS, Sampler

INPUTS = [
    ("load.normal_force", 1),
    ("creepage.misalignment@2", 2),
    ("friction.coefficient", 1),
    ("shaft.runout", 1),
    ("shaft.bend", 3),
]
CORRELATIONS = [("load.normal_force", "shaft.runout", 0.6)]
TOTAL = 50


@pytest.fixture(params=PLANS)
def make(request):
    """Return a function that creates a sampler of each design."""

    def made(inputs=INPUTS, seed=4, correlations=CORRELATIONS):
        return Sampler(seed, inputs, request.param, TOTAL, correlations)

    return made


def assert_same(one, other, names=None):
    for name in names or one:
        np.testing.assert_array_equal(one[name], other[name], strict=True)


def test_uniforms_have_the_documented_shape_and_range(make):
    drawn = make().uniforms(10, 7)
    assert {name: array.shape for name, array in drawn.items()} == {
        name: (7, dimension) for name, dimension in INPUTS
    }
    assert all(((array > 0.0) & (array < 1.0)).all() for array in drawn.values())


@pytest.mark.parametrize("batch", [1, 3, 8, 49])
def test_uniforms_are_independent_of_the_batch_size(make, batch):
    whole = make().uniforms(0, TOTAL)
    sampler = make()
    starts = list(range(0, TOTAL, batch))[::-1]
    parts = {start: sampler.uniforms(start, min(batch, TOTAL - start)) for start in starts}
    for name in whole:
        joined = np.concatenate([parts[start][name] for start in sorted(parts)])
        np.testing.assert_array_equal(joined, whole[name], strict=True)


def test_uniforms_are_independent_of_the_order_of_inputs(make):
    turned = [(second, first, rank) for first, second, rank in CORRELATIONS]
    assert_same(make().uniforms(0, 20), make(INPUTS[::-1], correlations=turned).uniforms(0, 20))


def test_uniforms_are_independent_of_other_inputs(make):
    # sufficiently many for collisions of names hashed into a few dozen dimensions
    more = [(f"extra.input_{k}", 1 + k % 3) for k in range(60)] + [("creepage.longitudinal", 1)]
    assert_same(make().uniforms(0, 20), make([*more, *INPUTS]).uniforms(0, 20), dict(INPUTS))


def test_seed_changes_all_inputs(make):
    one, other = make(seed=1).uniforms(0, 20), make(seed=2).uniforms(0, 20)
    assert all((one[name] != other[name]).all() for name in one)


def test_zero_realisations_give_empty_arrays(make):
    assert {array.shape[0] for array in make().uniforms(5, 0).values()} == {0}


def test_negative_realisations_are_refused(make):
    with pytest.raises(ValueError, match="counted from 0, got 3 of them from -1 on"):
        make().uniforms(-1, 3)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ([("a", 1), ("b", 1), ("a", 2)], "the input a is given twice"),
        ([("a", 0)], "the input a must take 1 or more numbers, got 0"),
        (
            [("creepage.misalignment", 2), ("creepage.tilt", 1)],
            "creepage.misalignment and creepage.tilt are one quantity",
        ),
    ],
)
def test_invalid_inputs_are_refused(inputs, message):
    with pytest.raises(ValueError, match=message):
        Sampler(1, inputs, "sobol")


@pytest.mark.parametrize("batch", [1, 3, 8, 49])
def test_replicates_are_independent_of_the_batch_size(batch):
    sampler = Sampler(4, INPUTS, "sobol", correlations=CORRELATIONS, replicates=8)
    whole = sampler.uniforms(0, TOTAL)
    for start in range(0, TOTAL, batch):
        count = min(batch, TOTAL - start)
        part = sampler.uniforms(start, count)
        assert_same({name: whole[name][start : start + count] for name in whole}, part)
