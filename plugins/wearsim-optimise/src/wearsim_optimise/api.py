"""Optimisation of design variables: start and resume."""

from __future__ import annotations

import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wearsim import Scenario, load_scenario
from wearsim.arguments import ArgumentError
from wearsim.atomic_write import write_lock
from wearsim.errors import InfeasibleCamError, Interrupted, ScenarioError, mistake_in
from wearsim.plugins import kind_of, quantity
from wearsim.results.io.files import read_study, write_results
from wearsim.results.io.outputs import output_lock
from wearsim.results.kinds import as_plugin
from wearsim.studies.execution.factory import executor
from wearsim.studies.preparation import origin_of
from wearsim.studies.progress import shown_progress
from wearsim_optimise.after import active_constraints, confirmation, sensitivity, tolerances
from wearsim_optimise.designs import Design, Designs
from wearsim_optimise.fronts import front_of
from wearsim_optimise.goals import Constraint, Goals, asked_names, parse_constraint
from wearsim_optimise.program import Plan, best_of, objective, optimum
from wearsim_optimise.result import (
    OptimisationData,
    OptimisationResult,
    columns_of,
    not_converged,
)
from wearsim_optimise.variables import (
    Variable,
    as_table,
    check_variables,
    from_table,
    overrides,
    parse_variable,
    start_of,
)

Watcher = Callable[[int, int, str], object]
METHODS = ("auto", "cobyqa", "evolution")
_BASE, _PER_VARIABLE = 10, 15  # default number of designs of a search, and more per variable
_PRELOAD = "wearsim_optimise.evaluation numba scipy.special"


def optimise(
    scenario: Scenario | str | Path,
    vary: Sequence[str] = (),
    output: str | Path | None = None,
    *,
    maximise: str | Sequence[str] = (),
    minimise: str | Sequence[str] = (),
    subject_to: Sequence[str] = (),
    then: str = "",
    realisations: int | None = None,
    evaluations: int | None = None,
    starts: int | None = None,
    method: str = "auto",
    most: str | None = None,
    tolerance: Sequence[str] = (),
    confirm: bool = True,
    workers: int | None = None,
    scheduler: str = "processes",
    force: bool = False,
    progress: bool = False,
    on_progress: Watcher | None = None,
    on_notice: Callable[[str], None] | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> OptimisationResult:
    """Return the best values of design variables.

    What is not given is taken from the table [optimise] of the scenario.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file; its values are the first design.
    vary : sequence of str
        Variables: "cam.base_radius=35mm:60mm"; whole numbers "operation.rollers=1:4"; a list
        "cam.material=steel,bronze". Keys with one value are joined by a plus sign, and an entry of
        a list has its number, "cam.motion.2.law+cam.motion.4.law=cycloidal,modified-sine".
    output : path, optional
        Results file; without it the result is kept in memory only.
    maximise, minimise : str or sequence of str
        One objective or two: names of quantities that the verbs cam, contact, run, ensemble and
        life state, "life.b10", "outer_radius", "ensemble.depth.p95".
    subject_to : sequence of str
        Constraints, "peak_pressure < 900 MPa".
    then : str
        Quantity that is least among the designs within 1 % of the best objective.
    realisations : int, optional
        Realisations of lives and ensembles, with common draws for all designs.
    evaluations : int, optional
        Greatest number of designs that the search runs; by default 10, and 15 for each variable.
    starts : int, optional
        Starts of the search, the scenario among them.
    method : {"auto", "cobyqa", "evolution"}
        COBYQA; or an evolution strategy, which is chosen for integers and lists and where lives are
        counted.
    most : str, optional
        Life at which realisations are censored, as of `life`.
    tolerance : sequence of str
        Tolerances of the drawing, within which neighbours of the optimum are evaluated,
        "cam.base_radius=0.05mm".
    confirm : bool
        Whether the optimum is confirmed with fresh draws.
    workers, scheduler, force, progress, on_notice, stop_requested
        As in `ensemble`.
    on_progress : callable, optional
        Called with the number of designs, their greatest number and a text.

    Returns
    -------
    OptimisationResult
        With ``.best_values``, ``.best_scenario``, ``.front``, ``.designs`` and ``.plot()``.

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the scenario cannot be used, or the file must not be replaced.
    TypeError, ValueError
        If an argument is invalid.
    WearsimError
        If no design is feasible; the message says which constraint is least violated, and where.
    Interrupted
        If it was stopped; `resume_optimise` continues from the file.

    Examples
    --------
    >>> import wearsim
    >>> result = wearsim.optimise(
    ...     "rig.toml",
    ...     ["roller.crown_radius=300mm:900mm"],
    ...     minimise="contact.power",
    ...     subject_to=["peak_pressure < 650 MPa"],
    ...     scheduler="serial",
    ... )
    >>> result.best.is_feasible
    True
    """
    loaded = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    table: Any = loaded.tables.get("optimise")
    lists = {"vary": vary, "subject_to": subject_to, "tolerance": tolerance}
    request = _request(
        loaded,
        {name for name, texts in lists.items() if not texts},
        vary=vary or (table.vary if table else ()),
        maximise=_listed(maximise) or (() if minimise or not table else table.maximise),
        minimise=_listed(minimise) or (() if maximise or not table else table.minimise),
        subject_to=subject_to or (table.subject_to if table else ()),
        then=then or (table.then if table else ""),
        realisations=_given(realisations, table.realisations if table else 40),
        evaluations=_given(evaluations, table.evaluations if table else None),
        starts=_given(starts, table.starts if table else 3),
        method=method,
        most=most,
        tolerance=tolerance or (table.tolerance if table else ()),
        confirm=confirm,
    )
    origin = origin_of(loaded)
    data = OptimisationData(
        **{**origin, "plugins": [*origin["plugins"], as_plugin("optimisation")]},
        notes=list(loaded.notes),
        finished=False,
        wall_seconds=0.0,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        request=request,
    )
    path = None if output is None else Path(output)
    with (
        output_lock(path, force, loaded.paths),
        shown_progress(progress, "PartWatcher", on_progress, loaded) as watch,
    ):
        hands = workers, scheduler, watch, on_notice or getattr(watch, "notice", None)
        return _Study(loaded, data, path, *hands, stop_requested).finish()


def resume_optimise(
    file: str | Path,
    *,
    workers: int | None = None,
    scheduler: str = "processes",
    progress: bool = False,
    on_progress: Watcher | None = None,
    on_notice: Callable[[str], None] | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> OptimisationResult:
    """Continue an optimisation from its file; the result equals an unbroken one.

    Parameters
    ----------
    file : path
        Results file of `optimise`.
    workers, scheduler, progress, on_progress, on_notice, stop_requested
        As in `optimise`.

    Returns
    -------
    OptimisationResult

    Raises
    ------
    ResultsFileError
        If the file cannot be read, or is being written by another process.
    Interrupted
        As in `optimise`.
    """
    path = Path(file)
    status = path.stat() if path.exists() else None
    data = read_study(path, OptimisationData)
    before = OptimisationResult(data, path)
    if data.finished:
        return before
    with (
        write_lock(path, status),
        shown_progress(progress, "PartWatcher", on_progress, before.scenario) as watch,
    ):
        hands = workers, scheduler, watch, on_notice or getattr(watch, "notice", None)
        return _Study(before.scenario, data, path, *hands, stop_requested).finish()


def _listed(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) and names else tuple(names)


def _given(value: int | None, default: int | None) -> int | None:
    return default if value is None else value


@contextmanager
def _checking(argument: str, scenario: Scenario, from_table: Container[str]) -> Iterator[None]:
    """Turn a ValueError into that of an argument, or a mistake of [optimise] that gives it."""
    try:
        yield
    except ValueError as error:
        if argument in from_table and "optimise" in scenario.tables:
            raise mistake_in(scenario.file, str(error), table="optimise", key=argument) from error
        raise ArgumentError(argument, str(error)) from error


def _variables(scenario: Scenario, texts: Sequence[str]) -> list[Variable]:
    """Return the variables of texts; raise a ValueError if the scenario cannot have them."""
    variables = [parse_variable(text) for text in texts]
    if not variables:
        raise ValueError("nothing is varied; name a variable, such as cam.base_radius=35mm:60mm")
    check_variables(variables, scenario)
    designs = [overrides(variables, start_of(scenario, variables))]
    for variable in variables:  # a choice that no scenario can have is an error at once
        designs += [overrides([variable], [number]) for number in range(len(variable.choices))]
    for design in designs:
        try:
            scenario.changed(design)
        except InfeasibleCamError:  # the search leads away from it
            pass
        except ScenarioError as error:
            raise ValueError("; ".join(map(str, error.mistakes))) from error
    return variables


def _request(scenario: Scenario, from_table: Container[str], **given: Any) -> dict[str, Any]:
    """Return the request as plain data.

    Parameters
    ----------
    scenario : Scenario
    from_table : container of str
        Names of arguments that are not given, but taken from the table [optimise].
    **given
        Values by argument.

    Raises
    ------
    ArgumentError, ScenarioError
        For values that cannot be read.
    """
    with _checking("vary", scenario, from_table):
        variables = _variables(scenario, given["vary"])
    objectives = [(name, 1) for name in given["maximise"]]
    objectives += [(name, -1) for name in given["minimise"]]
    if not 1 <= len(objectives) <= 2:
        raise ArgumentError(
            "maximise",
            f"one objective or two are needed, got {len(objectives)}; name a quantity to maximise"
            " or minimise, such as life.b10",
        )
    if len({name for name, _ in objectives}) < len(objectives):
        text = f"'{objectives[0][0]}' is given as two objectives; delete one of them"
        raise ArgumentError("minimise", text)
    if len(objectives) == 2 and given["then"]:
        text = "a second choice goes with one objective, not with a front of two"
        raise ArgumentError("then", text)
    if given["method"] not in METHODS:
        text = f"'{given['method']}' is no method, expected one of {', '.join(METHODS)}"
        raise ArgumentError("method", text)
    evaluations = given["evaluations"] or _BASE + _PER_VARIABLE * len(variables)
    for name, value, lowest in (
        ("evaluations", evaluations, 3),
        ("starts", given["starts"], 1),
        ("realisations", given["realisations"], 1),
    ):
        if value < lowest:
            raise ArgumentError(name, f"{name} must be {lowest} or more, got {value}")
    with _checking("subject_to", scenario, from_table):
        constraints = [asdict(parse_constraint(text)) for text in given["subject_to"]]
    with _checking("tolerance", scenario, from_table):
        widths = _tolerances(given["tolerance"], variables)
    return {
        "variables": [as_table(variable) for variable in variables],
        "objectives": [list(item) for item in objectives],
        "constraints": constraints,
        "then": given["then"],
        "evaluations": evaluations,
        "starts": given["starts"],
        "method": given["method"],
        "realisations": given["realisations"],
        "most": given["most"],
        "tolerances": widths,
        "confirm": given["confirm"],
    }


def _tolerances(texts: Sequence[str], variables: Sequence[Variable]) -> dict[str, float]:
    """Return tolerances in the units of the variables, by name."""
    tolerances = {}
    known = {v.name: v for v in variables if v.kind == "continuous"}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or name not in known:
            raise ValueError(
                f"'{text}' is not the tolerance of a continuous variable, expected one of"
                f" {', '.join(known) or 'them (there are none)'}, such as cam.base_radius=0.05mm"
            )
        variable = known[name]
        try:
            number = (
                quantity(value, kind_of(variable.unit).unit) / variable.size
                if variable.unit
                else float(value)
            )
        except ValueError as error:
            raise ValueError(f"'{text}': {error}") from error
        if not number > 0.0:
            raise ValueError(f"'{text}': a tolerance must be above zero")
        tolerances[name] = number
    return tolerances


class _Study:
    """An optimisation in progress."""

    def __init__(
        self,
        scenario: Scenario,
        data: OptimisationData,
        path: Path | None,
        workers: int | None,
        scheduler: str,
        watch: Watcher | None,
        on_notice: Callable[[str], None] | None,
        stop_requested: Callable[[], bool] | None,
    ) -> None:
        self.scenario, self.data, self.path = scenario, data, path
        self._workers, self._scheduler = workers, scheduler
        self._watch, self._notice, self._stop = watch, on_notice, stop_requested
        self._started, self._before = time.monotonic(), data.wall_seconds
        self._designs: Designs | None = None
        request = data.request
        self.variables = [from_table(item) for item in request["variables"]]
        self.plan = Plan(
            tuple((name, sign) for name, sign in request["objectives"]),
            tuple(Constraint(**item) for item in request["constraints"]),
            request["then"],
            request["evaluations"],
            request["starts"],
            request["method"],
            scenario.seed,
        )

    def finish(self) -> OptimisationResult:
        """Compute the remaining designs and return the result."""
        plan, request = self.plan, self.data.request
        with executor(
            self._scheduler,
            self._workers,
            on_notice=self._notice,
            stop_requested=self._stop,
            preload=_PRELOAD,
        ) as pool:
            designs = self._designs = Designs(
                self.scenario,
                self.variables,
                asked_names(plan.objectives, plan.constraints, plan.then),
                realisations=request["realisations"],
                most=request["most"],
                known=self.data.outcomes,
                pool=pool,
                on_outcome=self._kept,
                stop_requested=self._stop,
            )
            try:
                around = dict[int, Any]()

                def neighbours(design: Design) -> None:
                    rows = sensitivity(designs, design)
                    robustness = tolerances(designs, design, request["tolerances"])
                    around[design.number] = rows, robustness

                best, converged = optimum(designs, plan, neighbours)
                rows, robustness = around.get(best.number, ([], None))
                active = active_constraints(designs, best, rows)
                gains = confirmation(designs, designs.all[0], best) if request["confirm"] else []
            except Interrupted as error:
                raise self._interrupted(error) from error
            front = front_of(designs) if len(plan.objectives) == 2 else []
        data = self._content(
            finished=True,
            best=best.number,
            front=[design.number for design in front],
            sensitivity=rows,
            active=active,
            gains=gains,
            robustness=robustness,
            converged=converged,
            warnings=self._warnings(designs, converged=converged),
        )
        if self.path is not None:
            write_results(self.path, data)
        return OptimisationResult(data, self.path)

    def _warnings(self, designs: Designs, *, converged: bool) -> list[str]:
        warnings = [] if converged else [not_converged(self.plan.evaluations)]
        failed = [design for design in designs.all if design.status == "failed"]
        if failed:
            reason = failed[0].outcome["reason"].splitlines()[0]
            text = f"{len(failed)} designs failed, the first, number {failed[0].number}: {reason}"
            warnings.append(text)
        return warnings

    def _interrupted(self, error: Interrupted) -> Interrupted:
        if self.path is None:
            return Interrupted("stopped; nothing was written, since no output is given")
        kept = len(self.data.outcomes)
        return Interrupted(
            f"{self.path}: stopped; {kept} designs are kept",
            python=f'wearsim.resume_optimise("{self.path}") continues it',
            shell=f"continue with: wearsim resume {self.path}",
        )

    def _kept(self, key: str, outcome: Mapping[str, Any]) -> None:
        """Store an outcome in the file, and show the progress."""
        self.data = replace(self.data, outcomes={**self.data.outcomes, key: dict(outcome)})
        if self.path is not None:
            write_results(self.path, self._content(finished=False))
        designs = self._designs
        if self._watch is not None and designs is not None:
            most = self.plan.evaluations
            self._watch(min(designs.runs + 1, most), most, self._progress(designs))

    def _progress(self, designs: Designs) -> str:
        """Return the best design so far in words."""
        goals = designs.goals
        best = best_of(designs.all, objective(0)) if goals else None
        if best is None or goals is None:
            return "designs, none feasible yet"
        name = goals.objectives[0][0]
        return f"designs, best {name} {goals.shown(name, best.values[name])}"

    def _content(self, **changed: Any) -> OptimisationData:
        """Return the content of the file for the designs so far."""
        designs: list[Design] = self._designs.all if self._designs else []
        goals: Goals | None = self._designs.goals if self._designs else None
        self.data = replace(
            self.data,
            wall_seconds=self._before + time.monotonic() - self._started,
            named={name: dict(item) for name, item in goals.named.items()} if goals else {},
            first=dict(goals.first) if goals else {},
            designs=[
                {"key": d.key, "numbers": list(d.numbers), "purpose": d.purpose} for d in designs
            ],
            **changed,
        )
        columns = columns_of(self.variables, goals, designs)
        return replace(self.data, variables=columns)
