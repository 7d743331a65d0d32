"""Realisations of a study of lives: tests run to their limits, extended as far as needed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.evolution.limits import Limit
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.batch import RealisationRun, batch_groups
from wearsim.studies.ensemble.file.data import EnsembleData, Outcome
from wearsim.studies.ensemble.realisation import RealisationRunner, closed_form_depths
from wearsim.studies.life.batch import LifeRun, observe_lives
from wearsim.studies.life.factor import NEGLIGIBLE, RARE, ExactFactor, exact_factor
from wearsim.studies.life.rare.draws import changes_of, log_weight
from wearsim.studies.life.stored_settings import LifeSettings
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.grid import shared_strips
from wearsim.types import Grid

if TYPE_CHECKING:
    from wearsim.studies.life.result import LifeResult


EXTENSION = 4.0  # ratio of the lengths of successive attempts to reach a limit
_SAMPLE = 256  # realisations from which the length of the first attempt is chosen
_SHARE = 0.9  # of the realisations that reach their limit in it, by the closed form
_MARGIN = 1.3


def limits_of(scenario: Scenario) -> list[Limit]:
    """Return the limits of a scenario, in the order of its table."""
    named = ((key.replace("_", " "), value) for key, value in scenario.limit.given.items())
    return [Limit(name, value, name, scenario.outputs.width_threshold) for name, value in named]


def first_length(scenario: Scenario, fixed: Mapping[str, float], most: float) -> float:
    """Return the passes of the first attempt to reach the limits.

    For a limit of the depth of a cylinder, most realisations reach it then by the closed form of
    full slip; for others it is a multiple of the length of the test in the scenario.
    """
    length = EXTENSION * float(scenario.total_passes)
    limit = scenario.limit.depth
    if limit is not None and scenario.cam is None:
        columns = {
            **Drawer(scenario, "monte-carlo").columns(0, _SAMPLE),
            **{key: np.full(_SAMPLE, value) for key, value in fixed.items()},
        }
        with np.errstate(divide="ignore", invalid="ignore"):
            depths = closed_form_depths(scenario, columns, _SAMPLE)
            reached = scenario.total_passes * (limit / depths) ** 1.5
        if np.isfinite(reached).all():
            length = _MARGIN * float(np.quantile(reached, _SHARE))
    return float(min(max(math.ceil(length), 1.0), most))


def with_length(scenario: Scenario, passes: float) -> Scenario:
    """Return a scenario whose test has a number of roller passes."""
    return scenario.changed({"operation.passes": round(passes)})


class LevelRunner(RealisationRunner):
    """Runs of one length, with the wear factor of the study."""

    def __init__(
        self,
        scenario: Scenario,
        total: int,
        grid: Grid,
        fixed: Mapping[str, float],
        shift: Mapping[str, float],
        changes: Mapping[int, tuple[int, float]],
        mixture: Sequence[tuple[float, Mapping[str, float]]] = (),
    ) -> None:
        super().__init__(scenario, "monte-carlo", total, grid)
        self.fixed, self.shift, self.changes = dict(fixed), dict(shift), dict(changes)
        self.mixture = mixture

    def log_weight(self, realisation: int) -> float:
        """Return the logarithm of the weight of a realisation; 0 without a shift."""
        return log_weight(self.drawer, self.shift, realisation, self.mixture) if self.shift else 0.0

    @cached_property
    def start(self) -> Grid:
        """Strips with which all realisations start that fit on them."""
        return shared_strips(self.scenario, to_limits=True)

    @cached_property
    def drawer(self) -> Drawer:
        """Sampler of the random inputs."""
        return Drawer(
            self.scenario,
            "monte-carlo",
            self.total,
            fixed=self.fixed,
            shift=self.shift,
            changes=self.changes,
        )


class LifeRunner(RealisationRunner):
    """Lives of realisations of a scenario by number; can be sent to another process.

    Parameters
    ----------
    scenario : Scenario
        With limits.
    total : int
        Realisations of the whole study.
    grid : Grid
        Strips of the stored profiles.
    settings : LifeSettings
    base : float
        Passes of the first attempt to reach a limit.
    """

    def __init__(
        self, scenario: Scenario, total: int, grid: Grid, settings: LifeSettings, base: float
    ) -> None:
        super().__init__(scenario, "monte-carlo", total, grid)
        self.settings, self.base = settings, base
        self._levels: dict[tuple[int, int], LevelRunner] = {}

    @classmethod
    def continuing(cls, result: LifeResult, total: int | None) -> LifeRunner:  # type: ignore[override]
        """Return the runner of the tests in a file; parameters as of `RealisationRunner`."""
        data, settings = result.raw, result.settings
        plain = total or settings.plain
        return cls(
            result.scenario,
            plain,
            Grid(data.variables["y"], data.strip_width),
            replace(settings, plain=plain),
            data.life["base"],
        )

    @property
    def state(self) -> dict[str, object]:
        """Fields of the file that depend on the number of tests."""
        return {"life": {**asdict(self.settings), "base": self.base}}

    def further(self, result: LifeResult) -> LifeRunner | None:  # type: ignore[override]
        """Return the runner of the next tests for rare events, None after the last ones."""
        from wearsim.studies.life.rare.stages import next_stages  # noqa: PLC0415  (not of workers)

        if not (stages := next_stages(result)):
            return None
        return LifeRunner(
            self.scenario,
            stages[-1]["first"] + stages[-1]["count"],
            self.grid,
            replace(self.settings, stages=(*self.settings.stages, *stages)),
            self.base,
        )

    def result(self, data: EnsembleData, path: Path | None) -> LifeResult:
        """Return the result of the realisations in a file."""
        from wearsim.studies.life.result import LifeResult  # noqa: PLC0415  (not of workers)

        return LifeResult(data, path)

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes to be sent, without those that each process derives from them."""
        kept = super().__getstate__()
        kept.pop("factor", None)
        return {**kept, "_levels": {}}

    @cached_property
    def factor(self) -> ExactFactor | None:
        """Wear factor that is integrated exactly."""
        return exact_factor(self.scenario)[0] if self.settings.factor else None

    @property
    def fixed(self) -> dict[str, float]:
        """Wear factor with which the tests are run."""
        settings = self.settings
        return {settings.factor: settings.reference} if settings.factor else {}

    @property
    def longest(self) -> float:
        """Passes up to which tests are run; to the maximum and the target with great factors."""
        settings, factor = self.settings, self.factor
        if factor is None:
            return settings.most
        ends = settings.most * factor.exceeded(RARE)
        if settings.target is not None:
            ends = max(ends, settings.target * factor.exceeded(NEGLIGIBLE))
        return math.ceil(ends / settings.reference)

    def __call__(self, numbers: Sequence[int]) -> list[Outcome]:
        """Run realisations to their limits; the outcome of one that fails holds its error.

        A test that ends before its limit is repeated four times as long, so that its result does
        not depend on other realisations.
        """
        outcomes: dict[int, Outcome] = {}
        stages = np.searchsorted(
            [stage["first"] for stage in self.settings.stages], numbers, side="right"
        )
        for stage in np.unique(stages).tolist():
            level = 0
            left = [
                n
                for n, stage_of_test in zip(numbers, stages.tolist(), strict=True)
                if stage_of_test == stage
            ]
            while left:
                left, level = self._attempt(level, stage, left, outcomes), level + 1
        return [outcomes[number] for number in numbers]

    def _attempt(
        self, level: int, stage: int, numbers: list[int], outcomes: dict[int, Outcome]
    ) -> list[int]:
        """Run realisations of one length and stage; return those that need a longer test."""
        runner, limits, left = self._level(level, stage), limits_of(self.scenario), list[int]()
        last = runner.scenario.total_passes >= self.longest
        for group in batch_groups(runner.prepared(numbers, outcomes)):
            for run, outcome in zip(group, observe_lives(group, limits), strict=True):
                ended = (
                    isinstance(outcome, Exception) or outcome.reached or outcome.failure is not None
                )
                if not (ended or last):
                    left.append(run.number)
                else:
                    outcomes[run.number] = self._life_outcome(runner, run, outcome)
        return sorted(left)

    def _level(self, level: int, stage: int) -> LevelRunner:
        """Return the runner of a length and a stage, 0 for draws without weights."""
        if (level, stage) not in self._levels:
            scenario = with_length(self.scenario, min(self.base * EXTENSION**level, self.longest))
            stage_settings = self.settings.stages[stage - 1] if stage else {"shift": {}}
            self._levels[level, stage] = LevelRunner(
                scenario,
                self.total,
                self.grid,
                self.fixed,
                stage_settings["shift"],
                changes_of(self.settings.stages[:stage]),
                stage_settings.get("mixture", ()),
            )
        return self._levels[level, stage]

    def _life_outcome(
        self, runner: LevelRunner, run: RealisationRun, outcome: LifeRun | Exception
    ) -> Outcome:
        """Return the outcome of a realisation, with its life at the drawn wear factor."""
        if isinstance(outcome, Exception) or outcome.failure is not None:
            return self.outcome(run, outcome)
        scalars, scale, score_mean = dict(outcome.scalars), 1.0, 0.0
        if self.factor is not None:
            scale = self.settings.reference / float(run.drawn[self.settings.factor])
            score_mean = self.factor.score_mean(runner.drawer, run.number)
        for name in ("life", "life_low", "life_high"):
            scalars[name] *= scale
        scalars |= {"score_mean": score_mean, "log_weight": runner.log_weight(run.number)}
        return self.outcome(run, replace(outcome, scalars=scalars))
