"""A study of lives that is killed at any stage of writing continues to the same numbers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faulty_storage import WatchedStorage
from tests.studies.ensemble_cases import LOGNORMAL, differences
from tests.studies.life.test_life import design
from wearsim.studies.ensemble.api import resume_ensemble
from wearsim.studies.life import settings
from wearsim.studies.life.api import life
from wearsim.studies.life.result import LifeResult

COUNT = 4
RARE = 40  # fewer than in use, to save time


@pytest.fixture(scope="module", autouse=True)
def few_tests() -> Iterator[None]:
    """Accept few tests for rare ends of life."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settings, "LEAST_TESTS", RARE)
        yield


class Killed(BaseException):
    """End of the process, after which nothing is written."""


def counted(stages: list[str], last: int | None = None) -> WatchedStorage:
    """Return file operations that list their stages, and end at one of them."""

    def hook(stage: str) -> None:
        stages.append(stage)
        if last is not None and len(stages) > last:
            raise Killed

    return WatchedStorage(hook)


def study(path: Path, storage: WatchedStorage) -> LifeResult:
    """Run a study with tests for rare ends of life."""
    quick = {"evolution__tolerance": 5e-2, "evolution__strip_error": False}
    scenario = design(wear__roller__k_over_h={**LOGNORMAL, "median": "1e-20 1/Pa"}, **quick)
    return life(scenario, COUNT, path, target=1200, rare=RARE, scheduler="serial", storage=storage)


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> tuple[LifeResult, int]:
    """Return a study that is not killed, and the number of its stages of writing."""
    stages: list[str] = []
    return study(tmp_path_factory.mktemp("complete") / "study.h5", counted(stages)), len(stages)


@pytest.mark.parametrize(
    "part",
    [0.4, *(pytest.param(k / 20.0, marks=pytest.mark.slow) for k in range(1, 20, 3))],
)
def test_killed_study_continues_bit_for_bit(
    tmp_path: Path, part: float, complete: tuple[LifeResult, int]
) -> None:
    whole, stages = complete
    path, done = tmp_path / "killed.h5", list[str]()
    with pytest.raises(Killed):
        study(path, counted(done, int(part * stages)))
    result = (
        resume_ensemble(path, scheduler="serial") if path.exists() else study(path, counted([]))
    )
    assert differences(result, whole) == []
    assert result.rare == whole.rare
    assert result.b(50) == whole.b(50)
