"""Friction fields: marginal, correlation and independence of the grid."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.special import ndtri

from wearsim.models.random.varying import (
    GaussianField,
    GaussianFieldOptions,
    White,
    WhiteOptions,
)
from wearsim.plugins import Distribution, RandomInputSpec, registry
from wearsim.uq.sampling.sobol import Stream

MEAN, STD, LENGTH = 0.1, 0.02, 50e-6


class Normal(Distribution):
    """Normal distribution with a warning."""

    def quantile(self, probability):
        return MEAN + STD * ndtri(probability)

    @property
    def warnings(self):
        return ("marginal",)


def gaussian(**options):
    return GaussianField(GaussianFieldOptions(correlation_length="50 um", **options), Normal())


def uniforms(realisation=0):
    stream = Stream(6, "friction.coefficient", "field")
    return lambda first, count: stream.uniforms(first, count, realisation)


def grid(x, y):
    """Return the points of a rectangular grid in the form of `FrictionField.values`."""
    return np.repeat(np.asarray(x)[:, None], len(y), axis=1), np.asarray(y)


@pytest.mark.parametrize("field", [gaussian(), White(WhiteOptions(), Normal())])
def test_realisations_have_the_marginal_distribution(field):
    runs = 2000
    x, y = grid([0.0, 13e-6], [-1.2e-3, 0.0, 31e-6])
    drawn = np.array([field.values(x, y, uniforms(k)) for k in range(runs)])
    assert np.abs(drawn.mean(axis=0) - MEAN).max() < 4.0 * STD / np.sqrt(runs)
    assert np.abs(drawn.std(axis=0) - STD).max() < 4.0 * STD / np.sqrt(2.0 * runs)


def test_correlation_is_gaussian_and_isotropic():
    runs, distances = 2000, LENGTH * np.array([0.5, 1.0, 2.0])
    x, y = grid([7e-6, *(7e-6 + distances)], [-4e-6, *(-4e-6 + distances)])
    scores = (np.array([gaussian().values(x, y, uniforms(k)) for k in range(runs)]) - MEAN) / STD
    correlation = np.mean(scores * scores[:, :1, :1], axis=0)
    along, across = np.meshgrid([0.0, *distances], [0.0, *distances], indexing="ij")
    expected = np.exp(-(along**2 + across**2) / LENGTH**2)
    # the product of two scores of correlation r has the variance 1 + r^2
    assert (np.abs(correlation - expected) < 4.0 * np.sqrt((1.0 + expected**2) / runs)).all()


def test_field_is_independent_of_grid_and_extent():
    x, y = np.linspace(-3e-4, 3e-4, 25), np.linspace(-2e-3, 2e-3, 41)
    whole = gaussian().values(*grid(x, y), uniforms())
    # from other rows and columns of the lattice, and other tiles
    for rows, columns in (
        (slice(None, None, 3), slice(None, None, 5)),
        (slice(20, 24), slice(33, 40)),
        (slice(0, 1), slice(0, 1)),
    ):
        part = gaussian().values(*grid(x[rows], y[columns]), uniforms())
        np.testing.assert_array_equal(part, whole[rows, columns])


def test_points_may_differ_from_strip_to_strip():
    x, y = grid(np.linspace(0.0, 2e-4, 9), np.linspace(-1e-3, 1e-3, 11))
    shorter = x * np.linspace(0.0, 1.0, 11)
    field = gaussian().values(shorter, y, uniforms())
    for i in range(11):
        single = gaussian().values(shorter[:, i : i + 1], y[i : i + 1], uniforms())
        np.testing.assert_array_equal(field[:, i], single[:, 0])


def test_field_is_defined_far_from_the_origin():
    far = gaussian().values(*grid([157.0, 157.0 + LENGTH], [-40.0]), uniforms())
    near = gaussian().values(*grid([0.0, LENGTH], [0.0]), uniforms())
    assert (np.abs(far - MEAN) < 6.0 * STD).all()
    assert (far != near).all()


def test_realisations_differ():
    x, y = grid([0.0, 1e-4], [0.0, 1e-3])
    assert (gaussian().values(x, y, uniforms(0)) != gaussian().values(x, y, uniforms(1))).all()


def test_white_friction_uses_one_number_per_point_in_order():
    x, y = grid([0.0, 1e-6, 2e-6], [0.0, 1e-6])
    drawn = White(WhiteOptions(), Normal()).values(x, y, uniforms())
    np.testing.assert_array_equal(drawn.ravel(), Normal().quantile(uniforms()(0, 6)))


def test_white_friction_warns_of_grid_dependence():
    warnings = White(WhiteOptions(), Normal()).warnings
    assert warnings[0] == "marginal"
    assert "depends on the grid" in warnings[1]
    assert "gaussian-field" in warnings[1]
    assert gaussian().warnings == ("marginal",)


def test_spacing_of_half_the_correlation_length_resolves():
    assert gaussian().unresolved(25e-6, 25e-6) is None
    assert White(WhiteOptions(), Normal()).unresolved(1.0, 1.0) is None


@pytest.mark.parametrize(
    ("along", "across", "parts", "absent"),
    [
        (50e-6, 1e-6, ["50 um along rolling", "2 times as many points"], "strips"),
        (1e-6, 40e-6, ["40 um across the track", "1.6 times as many strips"], "points"),
        (50e-6, 40e-6, ["50 um along", "40 um across", "correlation length of 50 um"], "nan"),
    ],
)
def test_coarser_grid_is_reported_with_a_remedy(along, across, parts, absent):
    message = gaussian().unresolved(along, across)
    assert all(part in message for part in parts)
    assert absent not in message


@pytest.mark.parametrize("name", ["white", "gaussian-field"])
def test_fields_are_registered_by_name(name):
    spec = registry().get(RandomInputSpec, name)
    options = {} if name == "white" else {"correlation_length": "20 um"}
    made = spec.factory(spec.options(**options, frame="roller"), Normal())
    assert spec.role == "field"
    assert made.frame == "roller"
    with pytest.raises(ValidationError, match="frame"):
        spec.options(**options, frame="rig")
