"""Measurements of steppers, contact models and numbers of strips."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import get_args

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.steppers.per_pass import is_compiled
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE, EvolutionTable
from wearsim_bench.contact.methods import Method
from wearsim_bench.contact.worn_profiles import failure_reason
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.stepping.runs import EndState, PreparedTest, WearTest, errors_of
from wearsim_bench.stepping.solvers import SOLVERS, Solver, solved_by
from wearsim_bench.stepping.turns import TimedRun, add_rounds, compared, timed

EVERY_PASS = "per-pass"
CONVERGED = 1e-7  # tolerance of the reference solver if the loop over passes is not compiled
#: checks of the reference: ten times the tolerance, and an independent solver
_CHECKS: tuple[tuple[Solver, float], ...] = (("LSODA", 1e-6), ("BDF", CONVERGED))
CLOSE = 1e-5  # tolerance at which the error is negligible compared with that of the strips
CLOSER = 1e-6  # tolerance of the reference for numbers of strips,
FINEST = 6  # and its strips over the default number
MOST_STEPS = 1500  # steps above which lower tolerances are not tried
_WARM_UP = 1e-4  # fraction of the passes of an untimed run, for compilation
_STEPPERS = tuple(
    name
    for name in get_args(EvolutionTable.model_fields["stepper"].annotation)
    if name not in {"auto", EVERY_PASS}
)
#: steps a test from fresh bodies over a number of passes
Steps = Callable[[float], EndState]
#: called with a description of each measurement
Report = Callable[[str], object]


@dataclass(frozen=True)
class Reference:
    """Reference state at the end of a test.

    Parameters
    ----------
    end : EndState
        The final state.
    own : mapping of str to float
        Errors of the reference as in `errors_of`; empty for individually solved passes.
    """

    end: EndState
    own: Mapping[str, float]

    def errors_of(self, state: EndState) -> dict[str, float]:
        """Return the errors of a final state, at least those of the reference."""
        errors = errors_of(state, self.end)
        return {name: max(error, self.own.get(name, 0.0)) for name, error in errors.items()}

    @property
    def known(self) -> dict[str, float]:
        """Error of the reference profile as a count; empty if it is exact."""
        return {"truth": self.own["profile"]} if self.own else {}


@dataclass(frozen=True)
class StepperBenchmark:
    """Benchmark of steppers on one wear test with one contact model.

    Parameters
    ----------
    group : str
        Group of the measurements.
    test : WearTest
        The wear test.
    model : Method
        The contact model.
    rounds : int
        Rounds in which the methods of a group are timed in turns.
    report : callable
        Called with a description of each measurement.
    """

    group: str
    test: WearTest
    model: Method
    rounds: int
    report: Report

    def prepared(self, strips: int, **evolution: object) -> PreparedTest:
        """Return the test on `strips` strips, with keys of the table [evolution]."""
        contact = {"model": self.model.model, "strips": strips, **self.model.options}
        return PreparedTest(self.test.scenario_with({"contact": contact, "evolution": evolution}))

    def exact(self, strips: int) -> tuple[Measurement, Reference]:
        """Return the measurement of the reference, and the reference.

        It solves every pass individually if the loop over passes is compiled, and otherwise uses
        LSODA. The error of the latter is the larger of its differences from BDF at the same
        tolerance and from LSODA at ten times the tolerance.

        Raises
        ------
        SolverError, CapabilityError
            If the reference cannot be computed.
        """
        prepared = self.prepared(strips, stepper=EVERY_PASS)
        if is_compiled(prepared.problem):
            prepared.stepped(1.0)
            end, seconds = timed(lambda: prepared.stepped(prepared.stop))
            row = self._row(EVERY_PASS, "every pass", end)
            return replace(row, seconds=seconds), Reference(end, {})
        steps = partial(by_solver, "LSODA", prepared.problem, CONVERGED)
        end, seconds = timed(lambda: steps(prepared.stop))
        looser, by_bdf = (
            errors_of(by_solver(solver, prepared.problem, tolerance, prepared.stop), end)
            for solver, tolerance in _CHECKS
        )
        reference = Reference(end, {name: max(looser[name], by_bdf[name]) for name in looser})
        setting = f"converged, {_power(CONVERGED)}"
        row = self._row("LSODA", setting, end, known=reference.known)
        return replace(row, seconds=seconds), reference

    def first_run(
        self,
        method: str,
        setting: str,
        prepare: Callable[[], tuple[Steps, float]],
        exact: Reference,
        default: bool = False,
    ) -> TimedRun:
        """Return a method with its errors and the time of its first run.

        Parameters
        ----------
        method, setting : str
            Stepper or solver, and its tolerance or number of strips.
        prepare : callable
            Returns a function that steps the test, and the number of passes.
        exact : Reference
            The reference.
        default : bool
            Whether this is the default of a scenario.
        """
        self.report(f"{method}, {setting}")
        try:
            steps, stop = prepare()
            steps(max(_WARM_UP * stop, 1.0))
            run = partial(steps, stop)
            end, seconds = timed(run)
            row = self._row(method, setting, end, exact.errors_of(end), default, exact.known)
            return TimedRun(row, run, [seconds])
        except Exception as error:
            row = Measurement(self.group, method, setting, failed=failure_reason(error))
            return TimedRun(row, lambda: exact.end)

    def timed_in_turns(self, runs: Sequence[TimedRun], stepper: str) -> list[Measurement]:
        """Return the measurements of runs after all rounds, and remarks on the solvers.

        Parameters
        ----------
        runs : sequence of TimedRun
            Results of `first_run`.
        stepper : str
            Name of the stepper that the solvers are compared with.
        """
        self.report("timing in turns")
        add_rounds(runs, self.rounds)
        return [run.measurement for run in compared(runs, stepper, SOLVERS)]

    def _row(
        self,
        method: str,
        setting: str,
        end: EndState,
        errors: Mapping[str, float] | None = None,
        default: bool = False,
        known: Mapping[str, float] | None = None,
    ) -> Measurement:
        steps, solves = int(end.state.steps[0]), int(end.state.solves[0])
        counts = {"steps": steps} if steps else {}
        return Measurement(
            group=self.group,
            method=method,
            setting=setting,
            errors=errors or {},
            counts={**counts, "solves": solves, **(known or {})},
            default=default,
        )

    def failed(self, method: str, setting: str, error: Exception) -> list[Measurement]:
        """Return the measurement that replaces a group if its reference cannot be computed."""
        return [Measurement(self.group, method, setting, failed=failure_reason(error))]


def by_solver(solver: Solver, problem: WearProblem, tolerance: float, passes: float) -> EndState:
    """Step a wear problem by a solver of scipy; see `solved_by`."""
    return EndState(problem, solved_by(solver, problem, passes, tolerance))


def of_steppers(
    bench: StepperBenchmark, tolerances: Sequence[float], finer: Sequence[float] = ()
) -> list[Measurement]:
    """Return all steppers and solvers over tolerances, on the default strips.

    Parameters
    ----------
    bench : StepperBenchmark
        The benchmark.
    tolerances : sequence of float
        Decreasing tolerances. Failures for the same reason are reported once; after more than
        `MOST_STEPS` steps, lower tolerances are skipped.
    finer : sequence of float
        Tolerances of the default stepper, by default the same.
    """
    strips = bench.test.grid().strips
    try:
        bench.report("reference")
        row, exact = bench.exact(strips)
    except Exception as error:
        return bench.failed(EVERY_PASS, "every pass", error)
    usual = bench.prepared(strips).name
    runs: list[TimedRun] = []
    for method in (*_STEPPERS, *SOLVERS):
        failures = set()
        for tolerance in (finer or tolerances) if method == usual else tolerances:
            run = bench.first_run(
                method,
                f"tolerance {_power(tolerance)}",
                partial(_prepared, bench, strips, method, tolerance),
                exact,
                default=method == usual and tolerance == DEFAULT_TOLERANCE,
            )
            if run.row.failed not in failures or not run.row.failed:
                runs.append(run)
            failures.add(run.row.failed)
            if method != usual and run.row.counts.get("steps", 0) > MOST_STEPS:
                break
    return [row, *bench.timed_in_turns(runs, usual)]


def _prepared(
    bench: StepperBenchmark, strips: int, method: str, tolerance: float
) -> tuple[Steps, float]:
    solver = next((name for name in SOLVERS if name == method), None)
    if solver is not None:
        prepared = bench.prepared(strips)
        return partial(by_solver, solver, prepared.problem, tolerance), prepared.stop
    prepared = bench.prepared(strips, stepper=method, tolerance=tolerance)
    return prepared.stepped, prepared.stop


def of_model(bench: StepperBenchmark, tolerances: Sequence[float]) -> list[Measurement]:
    """Return a contact model with its default stepper, relative to its own reference."""
    strips, name = bench.test.grid().strips, bench.model.name
    try:
        bench.report(f"{name}, reference")
        _, exact = bench.exact(strips)
        usual = bench.prepared(strips).name
    except Exception as error:
        return bench.failed(name, "every pass", error)
    runs = [
        bench.first_run(
            name,
            f"{usual}, {_power(tolerance)}",
            partial(_prepared, bench, strips, usual, tolerance),
            exact,
            default=bench.model.default and tolerance == DEFAULT_TOLERANCE,
        )
        for tolerance in tolerances
    ]
    return bench.timed_in_turns(runs, usual)


def of_strips(
    bench: StepperBenchmark,
    counts: Sequence[int],
    tolerances: Sequence[float] = (DEFAULT_TOLERANCE,),
) -> list[Measurement]:
    """Return numbers of strips, with the default stepper and with steps of negligible error.

    The reference has `FINEST` times the default number of strips; its error is the larger of the
    differences from half as many strips and from ten times the tolerance.

    Parameters
    ----------
    bench : StepperBenchmark
        The benchmark.
    counts : sequence of int
        Numbers of strips in addition to the default.
    tolerances : sequence of float
        Tolerances of the default stepper.
    """
    default = bench.test.grid().strips
    try:
        bench.report("reference")
        fine, coarse = (bench.prepared(times * default + 1) for times in (FINEST, FINEST // 2))
        end, looser, coarser = (
            by_solver("LSODA", test.problem, tolerance, test.stop)
            for test, tolerance in ((fine, CLOSER), (fine, CLOSE), (coarse, CLOSER))
        )
        own = errors_of(looser, end), errors_of(coarser, end)
        exact = Reference(end, {name: max(one[name] for one in own) for name in own[0]})
    except Exception as error:
        return bench.failed("LSODA", f"{FINEST * default + 1} strips", error)
    settings = [*((fine.name, tolerance) for tolerance in tolerances), ("LSODA", CLOSE)]
    runs = [
        bench.first_run(
            f"{method}, {_power(tolerance)}",
            f"{strips} strips",
            partial(_prepared, bench, strips, method, tolerance),
            exact,
            default=method == fine.name and (strips, tolerance) == (default, DEFAULT_TOLERANCE),
        )
        for method, tolerance in settings
        for strips in sorted({*counts, default})
    ]
    return bench.timed_in_turns(runs, fine.name)


def _power(tolerance: float) -> str:
    """Return a tolerance as "1e-3"."""
    return f"{tolerance:.0e}".replace("e-0", "e-")
