"""The sampler: what does not change a draw, and what is refused."""

import numpy as np
import pytest

from wearsim.uq.sampling.plans import PLANS
from wearsim.uq.sampling.sampler import Sampler

INPUTS = [
    ("load.normal_force", 1),
    ("creepage.misalignment@2", 2),
    ("friction.coefficient", 1),
    ("shaft.runout", 1),
    ("shaft.bend", 3),
]
TIED = [("load.normal_force", "shaft.runout", 0.6)]
TOTAL = 50


@pytest.fixture(params=PLANS)
def make(request):
    """Return a function that makes a sampler of each plan."""

    def made(inputs=INPUTS, seed=4, correlations=TIED):
        return Sampler(seed, inputs, request.param, TOTAL, correlations)

    return made


def assert_same(one, other, names=None):
    for name in names or one:
        np.testing.assert_array_equal(one[name], other[name], strict=True)


def test_that_shapes_and_range_are_as_promised(make):
    drawn = make().uniforms(10, 7)
    assert {name: array.shape for name, array in drawn.items()} == {
        name: (7, dimension) for name, dimension in INPUTS
    }
    assert all(((array > 0.0) & (array < 1.0)).all() for array in drawn.values())


@pytest.mark.parametrize("batch", [1, 3, 8, 49])
def test_that_batches_change_no_bit(make, batch):
    whole = make().uniforms(0, TOTAL)
    sampler = make()
    starts = list(range(0, TOTAL, batch))[::-1]
    parts = {start: sampler.uniforms(start, min(batch, TOTAL - start)) for start in starts}
    for name in whole:
        joined = np.concatenate([parts[start][name] for start in sorted(parts)])
        np.testing.assert_array_equal(joined, whole[name], strict=True)


def test_that_the_order_of_inputs_changes_no_bit(make):
    turned = [(second, first, rank) for first, second, rank in TIED]
    assert_same(make().uniforms(0, 20), make(INPUTS[::-1], correlations=turned).uniforms(0, 20))


def test_that_more_inputs_change_no_bit_of_the_others(make):
    # enough of them that names hashed into a few dozen dimensions would meet
    more = [(f"extra.input_{k}", 1 + k % 3) for k in range(60)] + [("creepage.longitudinal", 1)]
    assert_same(make().uniforms(0, 20), make([*more, *INPUTS]).uniforms(0, 20), dict(INPUTS))


def test_that_a_seed_changes_all_inputs(make):
    one, other = make(seed=1).uniforms(0, 20), make(seed=2).uniforms(0, 20)
    assert all((one[name] != other[name]).all() for name in one)


def test_that_no_realisations_are_an_empty_batch(make):
    assert {array.shape[0] for array in make().uniforms(5, 0).values()} == {0}


def test_that_realisations_before_the_first_are_refused(make):
    with pytest.raises(ValueError, match="counted from 0, got 3 of them from -1 on"):
        make().uniforms(-1, 3)


@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ([("a", 1), ("b", 1), ("a", 2)], "the input a is given twice"),
        ([("a", 0)], "the input a must take 1 or more numbers, got 0"),
        (
            [("creepage.misalignment", 2), ("creepage.tilt", 1)],
            "creepage.misalignment and creepage.tilt are one quantity",
        ),
    ],
)
def test_that_inputs_that_cannot_be_drawn_are_refused(inputs, told):
    with pytest.raises(ValueError, match=told):
        Sampler(1, inputs, "sobol")


@pytest.mark.parametrize("batch", [1, 3, 8, 49])
def test_that_batches_change_no_bit_of_replicates(batch):
    sampler = Sampler(4, INPUTS, "sobol", correlations=TIED, replicates=8)
    whole = sampler.uniforms(0, TOTAL)
    for start in range(0, TOTAL, batch):
        count = min(batch, TOTAL - start)
        part = sampler.uniforms(start, count)
        assert_same({name: whole[name][start : start + count] for name in whole}, part)
