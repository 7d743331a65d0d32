"""What is stepped, and how: every stepper, every contact model, every number of strips."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import get_args

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.steppers.per_pass import is_compiled
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE, EvolutionTable
from wearsim_bench.contact.methods import Method
from wearsim_bench.contact.worn_profiles import why
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.measure.timing import least
from wearsim_bench.stepping.runs import End, Ready, WearTest, errors_of
from wearsim_bench.stepping.solvers import SOLVERS, Solver, solved_by

EVERY_PASS = "per-pass"
CONVERGED = 1e-7  # tolerance of the solver that is the truth where passes are not compiled
#: what the truth is checked by: itself ten times as loose, and a solver that shares no code
_CHECKS: tuple[tuple[Solver, float], ...] = (("LSODA", 1e-6), ("BDF", CONVERGED))
CLOSE = 1e-5  # tolerance at which a solver's error is next to none beside that of the strips
MOST_STEPS = 1500  # after which a stepper is not asked for still closer tolerances
_FEW = 1e-4  # of the passes, stepped first so that nothing compiles while it is timed
_STEPPERS = tuple(
    name
    for name in get_args(EvolutionTable.model_fields["stepper"].annotation)
    if name not in {"auto", EVERY_PASS}
)
#: takes passes, and steps a test from fresh bodies over as many
Steps = Callable[[float], End]


@dataclass(frozen=True)
class Truth:
    """The end that others are held against.

    Parameters
    ----------
    end : End
    own : mapping of str to float
        Its own errors as `errors_of` has them, by name; none of every pass by itself.
    """

    end: End
    own: Mapping[str, float]

    def errors_of(self, found: End) -> dict[str, float]:
        """Return the errors of another end, none less than the truth's own."""
        apart = errors_of(found, self.end)
        return {name: max(error, self.own.get(name, 0.0)) for name, error in apart.items()}

    @property
    def known(self) -> dict[str, float]:
        """To how much of the profile the truth is known, as a count; none if it is exact."""
        return {"truth": self.own["profile"]} if self.own else {}


@dataclass(frozen=True)
class Bench:
    """A test that is stepped by one contact model, and how often each way is timed.

    Parameters
    ----------
    group : str
        Name of the group that its measurements belong to.
    test : WearTest
    model : Method
        The contact model.
    repetitions : int
    """

    group: str
    test: WearTest
    model: Method
    repetitions: int

    def ready(self, strips: int, **evolution: object) -> Ready:
        """Return the test on so many strips, with keys of its table [evolution]."""
        contact = {"model": self.model.model, "strips": strips, **self.model.options}
        return Ready(self.test.asked({"contact": contact, "evolution": evolution}))

    def exact(self, strips: int) -> tuple[Measurement, Truth]:
        """Return the end that the others are held against, and what it took.

        Every pass by itself where there is compiled code for it, else what LSODA converges to. Its
        own errors are then how far it is from BDF of the same tolerance, which shares no code with
        it, or from itself ten times as loose, whichever is more.

        Raises
        ------
        SolverError, CapabilityError
            If it has none.
        """
        ready = self.ready(strips, stepper=EVERY_PASS)
        if is_compiled(ready.problem):
            ready.stepped(1.0)
            end, seconds = least(lambda: ready.stepped(ready.stop), 1)
            return self._row(EVERY_PASS, "every pass", seconds, end), Truth(end, {})
        steps = partial(by_solver, "LSODA", ready.problem, CONVERGED)
        end, seconds = least(lambda: steps(ready.stop), 1)
        looser, other = (
            errors_of(by_solver(solver, ready.problem, tolerance, ready.stop), end)
            for solver, tolerance in _CHECKS
        )
        truth = Truth(end, {name: max(looser[name], other[name]) for name in looser})
        setting = f"converged, {_power(CONVERGED)}"
        return self._row("LSODA", setting, seconds, end, known=truth.known), truth

    def measured(
        self,
        method: str,
        setting: str,
        prepare: Callable[[], tuple[Steps, float]],
        exact: Truth,
        default: bool = False,
    ) -> Measurement:
        """Return error and time of one way to step the test.

        Parameters
        ----------
        method, setting : str
        prepare : callable
            Returns what steps the test, and its passes.
        exact : Truth
        default : bool
        """
        try:
            steps, stop = prepare()
            steps(max(_FEW * stop, 1.0))
            end, seconds = least(lambda: steps(stop), self.repetitions)
            errors = exact.errors_of(end)
            return self._row(method, setting, seconds, end, errors, default, exact.known)
        except Exception as error:
            return Measurement(self.group, method, setting, failed=why(error))

    def _row(
        self,
        method: str,
        setting: str,
        seconds: float,
        end: End,
        errors: Mapping[str, float] | None = None,
        default: bool = False,
        known: Mapping[str, float] | None = None,
    ) -> Measurement:
        state = end.state
        counts = {"steps": state.steps} if state.steps else {}
        return Measurement(
            group=self.group,
            method=method,
            setting=setting,
            seconds=seconds,
            errors=errors or {},
            counts={**counts, "solves": state.solves, **(known or {})},
            default=default,
        )


def by_solver(solver: Solver, problem: WearProblem, tolerance: float, passes: float) -> End:
    """Step a problem over some passes by a solver of scipy's; parameters as of `solved_by`."""
    return End(problem, solved_by(solver, problem, passes, tolerance))


def of_steppers(bench: Bench, tolerances: Sequence[float]) -> Iterator[Measurement]:
    """Yield every stepper and solver over tolerances, all on the strips of the default one.

    Parameters
    ----------
    bench : Bench
    tolerances : sequence of float
        The coarsest first. A way that fails at several for one reason is told once; one that takes
        more than `MOST_STEPS` goes no further.
    """
    strips = bench.test.grid().strips
    try:
        row, exact = bench.exact(strips)
    except Exception as error:
        yield Measurement(bench.group, EVERY_PASS, "every pass", failed=why(error))
        return
    yield row
    usual = bench.ready(strips).name
    for method in (*_STEPPERS, *SOLVERS):
        told = set()
        for tolerance in tolerances:
            found = bench.measured(
                method,
                f"tolerance {_power(tolerance)}",
                partial(_prepared, bench, strips, method, tolerance),
                exact,
                default=method == usual and tolerance == DEFAULT_TOLERANCE,
            )
            if found.failed not in told or not found.failed:
                yield found
            told.add(found.failed)
            if found.counts.get("steps", 0) > MOST_STEPS:
                break


def _prepared(bench: Bench, strips: int, method: str, tolerance: float) -> tuple[Steps, float]:
    solver = next((name for name in SOLVERS if name == method), None)
    if solver is not None:
        ready = bench.ready(strips)
        return partial(by_solver, solver, ready.problem, tolerance), ready.stop
    ready = bench.ready(strips, stepper=method, tolerance=tolerance)
    return ready.stepped, ready.stop


def of_model(bench: Bench, tolerances: Sequence[float]) -> Iterator[Measurement]:
    """Yield a contact model with the stepper it gets, held against its own end and no other's.

    Parameters
    ----------
    bench : Bench
    tolerances : sequence of float
    """
    strips, name = bench.test.grid().strips, bench.model.name
    try:
        _, exact = bench.exact(strips)
        usual = bench.ready(strips).name
    except Exception as error:
        yield Measurement(bench.group, name, "every pass", failed=why(error))
        return
    for tolerance in tolerances:
        yield bench.measured(
            name,
            f"{usual}, {_power(tolerance)}",
            partial(_prepared, bench, strips, usual, tolerance),
            exact,
            default=bench.model.default and tolerance == DEFAULT_TOLERANCE,
        )


def of_strips(bench: Bench, counts: Sequence[int]) -> Iterator[Measurement]:
    """Yield numbers of strips, by the default steps and by steps whose error is next to none.

    They are held against twice as many strips as there are by default.

    Parameters
    ----------
    bench : Bench
    counts : sequence of int
        Numbers of strips, besides that of the default.
    """
    default = bench.test.grid().strips
    try:
        finest = bench.ready(2 * default + 1)
        exact = Truth(by_solver("LSODA", finest.problem, CLOSE, finest.stop), {})
    except Exception as error:
        yield Measurement(bench.group, "LSODA", f"{2 * default + 1} strips", failed=why(error))
        return
    for method, tolerance in ((finest.name, DEFAULT_TOLERANCE), ("LSODA", CLOSE)):
        for strips in sorted({*counts, default}):
            yield bench.measured(
                f"{method}, {_power(tolerance)}",
                f"{strips} strips",
                partial(_prepared, bench, strips, method, tolerance),
                exact,
                default=method == finest.name and strips == default,
            )


def _power(tolerance: float) -> str:
    """Return a tolerance in as few characters as it takes: "1e-3"."""
    return f"{tolerance:.0e}".replace("e-0", "e-")
