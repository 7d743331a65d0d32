"""Effects of random inputs on a life, and results without a file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.studies.life.test_life import design, lives
from wearsim.studies.life.api import life


def test_wear_factor_moves_the_life_most(tmp_path: Path) -> None:
    result = lives(tmp_path / "many.h5", count=60)
    assert result.sensitivity("life")[0].name == "wear.cylinder.k_over_h"
    assert next(iter(result.tornado())) == "wear.cylinder.k_over_h"
    effects = result.tornado()
    factor = effects["wear.cylinder.k_over_h"]
    # integrated exactly: a lognormal factor of 1.5
    assert factor.sign == -1
    assert factor.low.value == pytest.approx(1.2815516 * math.log(1.5), rel=1e-6)
    assert factor.high.value == pytest.approx(-1.2815516 * math.log(1.5), rel=1e-6)
    assert factor.high.half_width == 0.0
    # in full slip the life is in proportion to 1/(friction times load)
    for name, spread in (("friction.coefficient", 1.2), ("load.normal_force", 1.1)):
        expected = 1.2815516 * math.log(spread)
        found = effects[name]
        assert found.sign == -1
        assert found.low.value == pytest.approx(expected, rel=0.03)
        assert found.high.value == pytest.approx(-expected, rel=0.03)
        assert found.low.half_width < 0.03 * expected


def test_lives_stay_in_memory_without_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scenario = design(load__normal_force="300 N", friction__coefficient=0.1)
    found = life(scenario, 1, scheduler="serial")
    assert not list(tmp_path.iterdir())
    assert found.path is None
    assert found.b(50).value == lives(tmp_path / "kept.h5", scenario, 1).b(50).value
    assert found.with_settings(target=1e3).target == 1e3
