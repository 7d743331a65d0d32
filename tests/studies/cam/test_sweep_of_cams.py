"""Sweeps of cams as one dataset."""

import numpy as np
import pytest

import wearsim
from tests.studies.cam.cam_text import cam

SHORT = {"operation.turns": 2000, "evolution.tolerance": 1e-2, "contact.strips": 31}


@pytest.mark.parametrize(
    ("key", "values", "numbers", "unit"),
    [
        ("friction.coefficient", [0.08, 0.1], [0.08, 0.1], "1"),
        ("cam.base_radius", ["25 mm", "3 cm"], [0.025, 0.03], "m"),
        ("load.feedback", ["none", "static"], ["none", "static"], ""),
    ],
)
def test_ends_of_a_sweep_lie_along_its_key(key, values, numbers, unit):
    results = wearsim.sweep(cam("cycloidal").changed(SHORT), key, values)
    ends = results.to_xarray()
    assert ends[key].values.tolist() == numbers
    assert ends[key].attrs.get("units", "") == unit
    assert ends["lift_error_along_angle"].dims == (key, "angle")
    for place, result in enumerate(results):
        found = ends["depth"].isel({key: place}).values
        assert np.array_equal(found.ravel(), np.ravel(result.depth[-1]))
        assert np.array_equal(
            ends["lift_error_along_angle"].isel({key: place}),
            result.to_xarray()["lift_error_along_angle"].isel(record=-1),
        )
