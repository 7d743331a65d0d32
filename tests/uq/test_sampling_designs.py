"""Sampling designs: strata, nets and scrambles."""

import itertools

import numpy as np
import pytest
from scipy import stats

from wearsim.uq.sampling import sobol
from wearsim.uq.sampling.sampler import drawing, latin_hypercube, monte_carlo
from wearsim.uq.sampling.sobol import Stream

KNOWN = ("load.normal_force", "friction.coefficient", "creepage.longitudinal", "load.stiffness")
UNKNOWN = ("bearing.preload", "shaft.runout", "creepage.wobble@2")


def strata(uniform, count):
    """Return the number of points in each of `count` equal intervals."""
    return np.bincount((uniform * count).astype(int), minlength=count)


def test_monte_carlo_components_are_stream_blocks():
    drawn = monte_carlo(5, "creepage.misalignment", 2, first=3, count=6)
    stream = Stream(5, "creepage.misalignment", "test")
    np.testing.assert_array_equal(drawn[:, 0], stream.uniforms(3, 6))
    np.testing.assert_array_equal(drawn[:, 1], stream.uniforms(3, 6, block=1))


@pytest.mark.parametrize("total", [1, 2, 7, 100, 1000])
def test_latin_hypercube_has_one_realisation_per_stratum(total):
    drawn = latin_hypercube(1, total, "creepage.misalignment", 2, 0, total)
    for component in drawn.T:
        np.testing.assert_array_equal(strata(component, total), 1)
    assert ((drawn > 0.0) & (drawn < 1.0)).all()


def test_latin_hypercube_components_are_uncorrelated():
    total = 2000
    both = latin_hypercube(1, total, "creepage.misalignment", 2, 0, total)
    other = latin_hypercube(1, total, "load.normal_force", 1, 0, total)
    correlation = np.corrcoef(np.hstack([both, other]).T)
    assert np.abs(correlation[np.triu_indices(3, 1)]).max() < 4.0 / np.sqrt(total)


@pytest.mark.parametrize("word", [0, 2**64 - 1])
def test_stratum_ends_are_not_rounded_out_of_the_stratum(monkeypatch, word):
    def words(self, first, count, realisation=0, block=0):
        return np.full(count, word, dtype=np.uint64)

    monkeypatch.setattr(Stream, "words", words)
    drawn = latin_hypercube(0, 3, f"ends {word}", 1, 0, 3)[:, 0]
    assert ((drawn > 0.0) & (drawn < 1.0)).all()
    assert (drawn < np.array([1.0, 2.0, 3.0]) / 3.0).all()


def test_realisations_beyond_a_latin_hypercube_are_refused():
    with pytest.raises(ValueError, match=r"realisation 10 .* is beyond .* total is 10; .*greater"):
        latin_hypercube(1, 10, "a", 1, 8, 3)


@pytest.mark.parametrize(
    ("plan", "total", "message"),
    [
        ("latin-hypercube", None, "needs total"),
        ("latin-hypercube", 0, "total must be 1 or more realisations, got 0"),
        ("halton", None, 'unknown sampling plan "halton", expected one of monte-carlo'),
    ],
)
def test_invalid_designs_are_refused(plan, total, message):
    with pytest.raises(ValueError, match=message):
        drawing(plan, 1, total)


@pytest.mark.parametrize("name", [*KNOWN, *UNKNOWN, "creepage.yaw@0", "creepage.tilt@3"])
@pytest.mark.parametrize("power", [0, 3, 10])
def test_scrambled_points_have_one_point_per_interval(name, power):
    # also from a later multiple of 2^m
    for start in (0, 3 * 2**power):
        drawn = sobol.scrambled(11, name, 1, start, 2**power)[:, 0]
        np.testing.assert_array_equal(strata(drawn, 2**power), 1)


def pairs(power):
    first, second = (sobol.scrambled(2, name, 1, 0, 2**power) for name in KNOWN[:2])
    yield np.hstack([first, second])
    yield sobol.scrambled(2, "shaft.bend", 2, 0, 2**power)
    yield sobol.scrambled(2, "shaft.bend", 4, 5 * 2**power, 2**power)[:, 2:]


@pytest.mark.parametrize("power", [4, 8])
def test_pairs_have_one_point_per_elementary_box(power):
    for drawn in pairs(power):
        for wide in range(power + 1):
            rows = (drawn[:, 0] * 2**wide).astype(int)
            columns = (drawn[:, 1] * 2 ** (power - wide)).astype(int)
            boxes = np.bincount(rows * 2 ** (power - wide) + columns, minlength=2**power)
            np.testing.assert_array_equal(boxes, 1)


def test_nested_scramble_keeps_only_the_nesting():
    words = Stream(1, "words").words(0, 64).astype(np.uint32)
    near = words[:, None] ^ (np.uint32(1) << np.arange(32, dtype=np.uint32))
    key = sobol._key(1, "a", 0, 0)
    changed = sobol.nested_scramble(words, key)[:, None] ^ sobol.nested_scramble(near, key)
    # the highest different bit of two words is unchanged, and the bits above it are equal
    np.testing.assert_array_equal(
        np.frexp(changed.astype(float))[1], np.broadcast_to(np.arange(1, 33), changed.shape)
    )


@pytest.mark.parametrize("name", [KNOWN[0], UNKNOWN[0]])
def test_scrambled_points_are_uniform_within_their_intervals(name):
    # the mean of n numbers, one in each interval of 1/n, has the variance 1/(12 n^3)
    count, seeds = 64, 1000
    drawn = np.array([sobol.scrambled(seed, name, 1, 0, count)[:, 0] for seed in range(seeds)])
    assert stats.kstest(drawn[:, 5], "uniform").pvalue > 1e-4
    expected = 1.0 / np.sqrt(12.0 * count**3)
    means = drawn.mean(axis=1) - 0.5
    assert abs(means.mean()) < 4.0 * expected / np.sqrt(seeds)
    assert means.std() == pytest.approx(expected, rel=4.0 / np.sqrt(2.0 * seeds))


def test_sobol_error_is_far_below_monte_carlo_error():
    count, seeds = 1024, 60
    errors = []
    for seed in range(seeds):
        drawn = np.hstack([sobol.scrambled(seed, name, 1, 0, count) for name in KNOWN])
        errors.append(np.prod(0.5 + drawn, axis=1).mean() - 1.0)
    by_chance = np.sqrt(((13.0 / 12.0) ** len(KNOWN) - 1.0) / count)
    assert np.sqrt(np.mean(np.square(errors))) < by_chance / 50.0
    assert abs(np.mean(errors)) < 4.0 * np.std(errors) / np.sqrt(seeds)


def test_padded_inputs_are_independent_and_stratified():
    count, seeds = 256, 200
    sums, correlations = [], []
    for seed in range(seeds):
        one, two = (sobol.scrambled(seed, name, 1, 0, count)[:, 0] for name in UNKNOWN[:2])
        sums.append(np.mean(np.exp(one) + two**2) - (np.e - 1.0 + 1.0 / 3.0))
        correlations.append(12.0 * np.mean((one - 0.5) * (two - 0.5)))
    # variances of exp(u) and u^2
    by_chance = np.sqrt((0.5 * (np.e**2 - 1.0) - (np.e - 1.0) ** 2 + 4.0 / 45.0) / count)
    assert np.sqrt(np.mean(np.square(sums))) < by_chance / 50.0
    assert abs(np.mean(correlations)) < 4.0 * np.std(correlations) / np.sqrt(seeds)
    assert np.std(correlations) < 2.0 / np.sqrt(count)


def test_common_inputs_of_all_rollers_have_separate_dimensions():
    names = [name for name in sobol.SLOT_OF if name not in {"creepage.yaw", "creepage.tilt"}]
    taken = [
        slot
        for name, roller in itertools.product(names, ["", "@0", "@1", "@2", "@17"])
        for slot in sobol.slots(name + roller, sobol.SLOT_OF[name][1])
    ]
    assert len(set(taken)) == len(taken)
    yaw, tilt = sobol.slots("creepage.yaw@2", 1), sobol.slots("creepage.tilt@2", 1)
    assert [*yaw, *tilt] == [*sobol.slots("creepage.misalignment@2", 2)]


@pytest.mark.parametrize(
    ("name", "dimension"),
    [
        ("shaft.bend", 1),
        ("load.normal_force", 2),
        ("creepage.yaw@", 1),
        ("creepage.yaw@02", 1),
        ("creepage.yaw@left", 1),
        ("creepage.yaw@123456", 1),
    ],
)
def test_other_names_have_no_fixed_dimension(name, dimension):
    assert sobol.slots(name, dimension) is None
    drawn = sobol.scrambled(1, name, dimension, 0, 32)
    assert drawn.shape == (32, dimension)
    np.testing.assert_array_equal(strata(drawn[:, -1], 32), 1)


def test_sobol_realisations_beyond_the_last_are_refused():
    with pytest.raises(ValueError, match="has 4294967296 realisations"):
        sobol.scrambled(1, "a", 1, 2**32 - 1, 2)


@pytest.mark.parametrize("name", [KNOWN[0], UNKNOWN[0]])
def test_replicates_are_different_nets(name):
    plain = sobol.scrambled(11, name, 1, 0, 256)
    np.testing.assert_array_equal(sobol.scrambled(11, name, 1, 0, 256, 0), plain)
    drawn = [sobol.scrambled(11, name, 1, 0, 256, replicate)[:, 0] for replicate in range(4)]
    for one, other in itertools.combinations(drawn, 2):
        assert not (one == other).any()
    for one in drawn:
        np.testing.assert_array_equal(strata(one, 256), 1)


@pytest.mark.parametrize("name", [KNOWN[0], UNKNOWN[0]])
def test_realisations_alternate_between_replicates(name):
    drawn = drawing("sobol", 11, None, 8)(name, 1, 0, 100)
    for replicate in range(8):
        own = drawn[replicate::8]
        known = sobol.scrambled(11, name, 1, 0, len(own), replicate)
        np.testing.assert_array_equal(own, known)


def test_one_replicate_equals_the_plain_sequence():
    drawn = drawing("sobol", 11, None)("creepage.misalignment", 2, 5, 40)
    known = sobol.scrambled(11, "creepage.misalignment", 2, 5, 40)
    np.testing.assert_array_equal(drawn, known)
    np.testing.assert_array_equal(
        drawing("sobol", 11, None, 1)("creepage.misalignment", 2, 5, 40), known
    )


def test_replicates_are_independent_of_each_other():
    # means of replicates, over many seeds
    count, seeds = 16, 400
    means = np.array(
        [
            [sobol.scrambled(seed, "a", 1, 0, count, replicate).mean() for replicate in range(3)]
            for seed in range(seeds)
        ]
    )
    correlation = np.corrcoef(means.T)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4.0 / np.sqrt(seeds)


def test_zero_replicates_are_refused():
    with pytest.raises(ValueError, match="replicates must be 1 or more sequences, got 0"):
        drawing("sobol", 1, None, 0)


def test_nested_scramble_is_that_of_plain_integers():
    def reversed_bits(word):
        return int(f"{word:032b}"[::-1], 2)

    words = Stream(2, "words").words(0, 20).astype(np.uint32)
    key = sobol._key(1, "a", 0, 0)
    known = []
    for word in words.tolist():
        mixed = reversed_bits(word)
        for added, even, odd in key.tolist():
            mixed = (mixed + added) * odd % 2**32
            mixed ^= mixed * even % 2**32
        known.append(reversed_bits(mixed))
    assert sobol.nested_scramble(words, key).tolist() == known
    assert sobol.reverse_bits(words).tolist() == [reversed_bits(word) for word in words.tolist()]


@pytest.mark.parametrize("name", [KNOWN[0], UNKNOWN[0]])
def test_sobol_numbers_are_in_the_middle_of_their_intervals(name):
    drawn = sobol.scrambled(5, name, 1, 3, 50, 0)
    intervals = drawn * 2.0**32
    np.testing.assert_array_equal(intervals - np.floor(intervals), 0.5)
    assert ((drawn > 0.0) & (drawn < 1.0)).all()
