"""Extension of a test beyond its initial strips."""

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS


@pytest.mark.parametrize("stepper", ["implicit", "per-pass"])
def test_extended_test_gets_additional_strips(tmp_path, stepper):
    wear = {"wear.cylinder.k_over_h": "6e-9 1/Pa"}
    short = wearsim.load_scenario(
        SCENARIOS / "rig-450min.toml",
        overrides={
            "operation.duration": "5 s",
            "evolution.stepper": stepper,
            **wear,
        },
    )
    path = tmp_path / "short.h5"
    first = wearsim.run(short, path)
    result = wearsim.resume(path, until=100.0)
    assert result.finished
    assert result.time[-1] == pytest.approx(100.0)
    assert len(result.y) > len(first.y)
    margin = (len(result.y) - len(first.y)) // 2
    np.testing.assert_array_equal(result.y[margin:-margin], first.y)
    np.testing.assert_array_equal(result.profiles[1][margin:-margin], first.profiles[1])
    assert result.profiles[1][:margin].max() == 0.0
    # an unextended run of that length has other strips, and the same depth
    whole = wearsim.run(
        wearsim.load_scenario(
            SCENARIOS / "rig-450min.toml",
            overrides={"operation.duration": "100 s", **wear},
        )
    )
    assert result.depth[-1] == pytest.approx(whole.depth[-1], rel=3e-3)
    assert wearsim.open_results(path).depth[-1] == result.depth[-1]
