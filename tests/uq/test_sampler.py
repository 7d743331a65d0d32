"""Sampler: independence of draws from their context, and invalid input."""

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from wearsim.uq.sampling.sampler import PLANS, Sampler, latin_hypercube, monte_carlo
from wearsim.uq.sampling.sobol import scrambled

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


def test_designs_are_those_of_their_names():
    for plan in PLANS:
        sampler = Sampler(4, INPUTS[:1], plan, TOTAL)
        name, dimension = INPUTS[0]
        known = {
            "monte-carlo": monte_carlo(4, name, dimension, 3, 9),
            "latin-hypercube": latin_hypercube(4, TOTAL, name, dimension, 3, 9),
            "sobol": scrambled(4, name, dimension, 3, 9),
        }[plan]
        np.testing.assert_array_equal(sampler.uniforms(3, 9)[name], known)


def test_sobol_points_are_those_of_scipy_scrambled_by_their_key():
    # the unscrambled words follow from equal keys: differences of bits above the first are kept
    one, other = (scrambled(1, "load.normal_force", 1, first, 8)[:, 0] for first in (0, 5))
    np.testing.assert_array_equal(one[5:], other[:3])
    assert scrambled(1, "load.normal_force", 1, 0, 0).shape == (0, 1)
    assert scrambled(1, "shaft.runout", 1, 2**32 - 3, 3).shape == (3, 1)


@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_correlation_of_one_is_allowed_but_singular(value):
    with pytest.raises(ValueError, match="not positive definite"):
        Sampler(1, [("a", 1), ("b", 1)], correlations=[("a", "b", value)])


def test_chain_of_correlations_is_one_group():
    names = ["a", "b", "c", "d", "e"]
    chain = [("a", "b", 0.5), ("c", "d", 0.5), ("b", "c", 0.5)]
    drawn = Sampler(3, [(n, 1) for n in names], correlations=chain).uniforms(0, 4000)
    free = Sampler(3, [(n, 1) for n in names]).uniforms(0, 4000)
    matrix = np.eye(4)
    for row, column in ((0, 1), (2, 3), (1, 2)):
        matrix[row, column] = matrix[column, row] = 2.0 * np.sin(np.pi / 12.0)
    scores = ndtri(np.column_stack([free[n][:, 0] for n in names[:4]]))
    known = ndtr(scores @ np.linalg.cholesky(matrix).T)
    found = np.column_stack([drawn[n][:, 0] for n in names[:4]])
    assert found == pytest.approx(known, abs=1e-12)
    assert (drawn["e"] == free["e"]).all()


def test_errors_of_designs_name_the_range():
    with pytest.raises(ValueError, match="got 2 of them from -1 on"):
        Sampler(1, INPUTS).uniforms(-1, 2)
    with pytest.raises(ValueError, match="got -1 of them from 0 on"):
        Sampler(1, INPUTS).uniforms(0, -1)
    with pytest.raises(ValueError, match="replicates must be 1 or more sequences, got 0"):
        Sampler(1, INPUTS, "sobol", replicates=0)
    with pytest.raises(ValueError, match="the inputs are none"):
        Sampler(1, [], correlations=[("a", "b", 0.1)])
    assert Sampler(1, INPUTS, "latin-hypercube", 1).uniforms(0, 1)["shaft.runout"].shape == (1, 1)
    with pytest.raises(ValueError, match="beyond this latin-hypercube plan"):
        Sampler(1, INPUTS, "latin-hypercube", 10).uniforms(1, 10)
