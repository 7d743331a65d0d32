"""Evaluation of designs: the quantities that are asked for, by the studies that state them."""

from __future__ import annotations

import difflib
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import wearsim
from wearsim import Scenario
from wearsim.errors import InfeasibleCamError, ScenarioError, WearsimError
from wearsim.report.view import Answer

CHEAP = ("cam", "contact")  # studies before wear, made before any run
VERBS = ("cam", "contact", "run", "ensemble", "life")
_LIFE = re.compile(r"b(\d+(?:\.\d+)?)")
FAR = 0.05  # violation of a constraint before wear, over its limit, beyond which nothing is run
FRESH = 7919  # added to the seed for the draws of a confirmation
SAMPLES = 2000  # of a bootstrap

#: limits in SI before any run, by the name of the quantity: sign and number
Limits = Mapping[str, tuple[str, float]]
#: a design by dotted key, with the draws and whether it is evaluated before wear only
Job = Mapping[str, Any]


class UnknownQuantityError(WearsimError):
    """A quantity that no study states."""

    exit_code = 2


class Studies:
    """Studies of one design, each made when a quantity of it is asked for.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
    shares : sequence of float
        Percentages of the lives.
    most : str, optional
        Life at which realisations are censored.
    """

    def __init__(
        self, scenario: Scenario, realisations: int, shares: Sequence[float], most: str | None
    ) -> None:
        self.scenario, self.realisations, self.shares = scenario, realisations, shares
        self.most = most
        self._answers: dict[str, dict[str, Answer]] = {}

    def answers(self, verb: str) -> dict[str, Answer]:
        """Return the numbers of a study by name.

        Raises
        ------
        WearsimError
            If the study cannot be made.
        """
        if verb not in self._answers:
            study = getattr(self, verb)
            if getattr(study, "count", 1) == 0:
                raise WearsimError(next(iter(study.errors.values()), "no realisation is completed"))
            self._answers[verb] = study.view.answers()
        return self._answers[verb]

    @cached_property
    def cam(self) -> Any:
        """The cam before wear."""
        return wearsim.study_cam(self.scenario)

    @cached_property
    def contact(self) -> Any:
        """The fresh contact of the first roller."""
        return wearsim.study_contact(self.scenario)

    @cached_property
    def run(self) -> Any:
        """A wear test."""
        return wearsim.run(self.scenario)

    @cached_property
    def ensemble(self) -> Any:
        """Wear tests of the realisations, in a folder that is kept as long as the studies."""
        path = Path(self._folder.name) / "tests.h5"
        return wearsim.ensemble(self.scenario, self.realisations, path, scheduler="serial")

    @cached_property
    def _folder(self) -> TemporaryDirectory[str]:
        return TemporaryDirectory(prefix="wearsim-")

    @cached_property
    def life(self) -> Any:
        """Lives of the realisations."""
        options: dict[str, Any] = {"b": self.shares, "most": self.most, "scheduler": "serial"}
        return wearsim.life(self.scenario, self.realisations, **options)

    def verbs_of(self, name: str) -> list[str]:
        """Return the studies that may state a name, the cheapest first."""
        if "." in name and name.split(".", maxsplit=1)[0] in VERBS:
            return [name.split(".", maxsplit=1)[0]]
        is_cam, is_random = self.scenario.cam is not None, bool(self.scenario.random)
        test = "ensemble" if is_random else "run"
        if _LIFE.fullmatch(name):
            return ["life"]
        return [*(["cam"] if is_cam else ["contact"]), *([test] if self.scenario.wear else [])]

    def resolved(self, name: str) -> dict[str, Any]:
        """Return verb, name, unit and label of a quantity.

        Raises
        ------
        UnknownQuantityError
            If no study states it.
        """
        verbs, known = self.verbs_of(name), list[str]()
        plain = name.removeprefix(f"{verbs[0]}.") if len(verbs) == 1 else name
        for verb in verbs:
            answers = self.answers(verb)
            if plain in answers:
                answer = answers[plain]
                return {"verb": verb, "name": plain, "unit": answer.unit, "label": answer.label}
            known += [f"{verb}.{key}" for key in answers]
        similar = difflib.get_close_matches(
            name, [*known, *(k.split(".", 1)[1] for k in known)], n=1
        )
        hint = f"; did you mean '{similar[0]}'?" if similar else ""
        raise UnknownQuantityError(
            f"no quantity is named '{name}'{hint} (known: {', '.join(known)}; lives: life.b10)"
        )


@dataclass(frozen=True)
class Evaluation:
    """Function of numbers of jobs that evaluates their designs; sent to worker processes.

    Parameters
    ----------
    scenario : Scenario
    jobs : tuple of mapping
        ``overrides`` by dotted key; ``before_wear``, whether nothing is run; ``fresh``, whether the
        design is compared with the one of ``other``, by fresh draws.
    names : tuple of str
        Quantities that are asked for.
    named : mapping of str to dict
        Studies and units of the quantities; empty before the first design.
    limits : mapping
        Limits of quantities before wear.
    realisations : int
    most : str, optional
    """

    scenario: Scenario
    jobs: tuple[Job, ...]
    names: tuple[str, ...]
    named: Mapping[str, Mapping[str, Any]]
    limits: Limits
    realisations: int
    most: str | None = None

    def __call__(self, numbers: Sequence[int]) -> list[dict[str, Any]]:
        """Return the outcome of each job."""
        return [self._outcome(self.jobs[number]) for number in numbers]

    def _outcome(self, job: Job) -> dict[str, Any]:
        started = time.monotonic()
        outcome: dict[str, Any] = {"status": "evaluated", "reason": "", "values": {}, "margins": {}}
        try:
            if "other" in job:
                outcome["gain"] = self._gain(job)
            else:
                self._evaluate(job, outcome)
        except InfeasibleCamError as error:
            outcome |= {"status": "infeasible", "reason": str(error), "margins": error.margins}
        except UnknownQuantityError:
            raise
        except WearsimError as error:
            if not self.named and isinstance(error, ScenarioError):
                raise  # the scenario as given cannot be used
            outcome |= {"status": "failed", "reason": str(error)}
        except (ValueError, ArithmeticError) as error:
            if not self.named:
                raise
            outcome |= {"status": "failed", "reason": f"{type(error).__name__}: {error}"}
        return {**outcome, "seconds": time.monotonic() - started}

    def _studies(self, overrides: Mapping[str, Any]) -> Studies:
        shares = [float(match[1]) for name in self.names if (match := _LIFE.search(name))]
        scenario = self.scenario.changed(overrides)
        return Studies(scenario, self.realisations, shares or [10.0], self.most)

    def _evaluate(self, job: Job, outcome: dict[str, Any]) -> None:
        """Add the values of a design to its outcome."""
        studies = self._studies(job["overrides"])
        if studies.scenario.cam is not None:
            outcome["margins"] = studies.cam.turn.margins
        named = dict(self.named) or {name: studies.resolved(name) for name in self.names}
        outcome["named"] = named if not self.named else {}
        values = outcome["values"]
        order = sorted(self.names, key=lambda name: VERBS.index(named[name]["verb"]))
        for name in order:
            verb, plain = named[name]["verb"], named[name]["name"]
            if verb not in CHEAP and (job.get("before_wear") or self._is_far(values)):
                outcome["status"] = "before wear"
                continue
            answers = studies.answers(verb)
            value = answers[plain].value if plain in answers else math.nan
            if math.isnan(value):
                outcome["status"] = "failed"
                outcome["reason"] = f"{name} is not known" + (
                    ": most tests end before a limit; give a greater maximum of the lives"
                    if verb == "life"
                    else ""
                )
            values[name] = value
        outcome["rough"] = "life" in studies.__dict__ and not studies.life.is_exact

    def _is_far(self, values: Mapping[str, float]) -> bool:
        """Return whether a limit before wear is violated by far."""
        for name, (sign, limit) in self.limits.items():
            if name in values:
                excess = values[name] - limit if sign == "<" else limit - values[name]
                if excess > FAR * (abs(limit) or 1.0):
                    return True
        return False

    def _gain(self, job: Job) -> dict[str, Any]:
        """Return an objective of two designs with fresh draws, and the ratio with its interval."""
        name = job["name"]
        named = self.named[name]
        seed = {"seed": self.scenario.seed + FRESH}
        pair = [self._studies({**job[which], **seed}) for which in ("overrides", "other")]
        values = [studies.answers(named["verb"])[named["name"]].value for studies in pair]
        ratio = values[0] / values[1] if values[1] else math.nan
        low = high = ratio
        if named["verb"] == "life":
            share = float(_LIFE.search(name)[1])  # type: ignore[index]
            interval = pair[0].life.compare(pair[1].life, share).b10_ratio
            ratio, low, high = interval.value, interval.low, interval.high
        elif named["verb"] == "ensemble":
            low, high = _bootstrap(pair, named["name"])
        return {"values": values, "ratio": ratio, "low": low, "high": high}


def _bootstrap(pair: Sequence[Studies], name: str) -> tuple[float, float]:
    """Return the 95 % interval of the ratio of a statistic of two ensembles with common draws."""
    quantity, _, ending = name.partition(".")
    values = [np.ravel(studies.ensemble.at_end(quantity)) for studies in pair]
    if len(values[0]) != len(values[1]) or len(values[0]) < 2:
        return -math.inf, math.inf
    statistic: Callable[..., Any] = np.mean
    if ending == "std":
        statistic = np.std
    elif ending.startswith("p"):
        statistic = _Quantile(float(ending[1:]) / 100.0)
    chosen = np.random.default_rng(0).integers(0, len(values[0]), (SAMPLES, len(values[0])))
    ratios = statistic(values[0][chosen], axis=1) / statistic(values[1][chosen], axis=1)
    low, high = np.quantile(ratios, (0.025, 0.975))
    return float(low), float(high)


@dataclass(frozen=True)
class _Quantile:
    """Quantile along an axis."""

    probability: float = field(default=0.5)

    def __call__(self, values: Any, axis: int) -> Any:
        return np.quantile(values, self.probability, axis=axis)
