"""Answers of a page: a scenario computed at one stage, as rows, panels and remarks."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import wearsim
from wearsim.report import Panel, Recording, Text, panels_of, record
from wearsim_explore.design import Design

Stage: TypeAlias = Literal["first", "final", "lives", "report"]
#: changes for a first answer: the greatest allowed tolerance, and no second test on wider strips
COARSE: dict[str, Any] = {"evolution.tolerance": 0.1, "evolution.strip_error": False}
FIRST_TESTS, MOST_TESTS = 16, 1024  # of a study of lives
_NUMBER = re.compile(
    r"(-?[\d,]*\.?\d+(?:e[+-]?\d+)?)(?: ± \S+)? ?([^\d\[,;]*(?:\^\d)?)(?: ± \S+ ?\2)?(?:\[.*\])?"
)
_EVERY = 2  # every second frame of an animation is shown


@dataclass(frozen=True)
class Request:
    """A computation that a page asks for.

    Parameters
    ----------
    session : str
        Name of the session that asks.
    number : int
        Number of the state of the design in its session.
    stage : {"first", "final", "lives", "report"}
    design : Design
    scratch : Path
        Folder for files of this session.
    tests : int
        Number of tests of lives; 0 for the scatter of the wear factor alone.
    frame : int
        Frame of the animation that the first answer shows.
    """

    session: str
    number: int
    stage: Stage
    design: Design
    scratch: Path
    tests: int = 0
    frame: int = 0


@dataclass(frozen=True)
class Quantity:
    """A row of an answer: label, and text with unit and error."""

    label: str
    text: str

    @property
    def number(self) -> tuple[float, str] | None:
        """The number and its unit, if the text has only one."""
        match = _NUMBER.fullmatch(self.text)
        return (float(match[1].replace(",", "")), match[2].strip()) if match else None


@dataclass(frozen=True)
class FieldMistake:
    """A mistake of the scenario: table and key, empty if it has none, and the text of `check`."""

    table: str
    key: str
    text: str


@dataclass(frozen=True)
class Drawn:
    """A panel with what it draws, and with its frames if it moves."""

    panel: Panel
    recording: Recording
    frames: tuple[Recording, ...] = ()


@dataclass(frozen=True)
class Answer:
    """What a page shows of a computation.

    Parameters
    ----------
    title, question, basis : str
        Texts of the view.
    rows : tuple of Quantity
    remarks : tuple of str
    panels : mapping of str to Drawn
    steps : tuple of str
        Texts of the time slider.
    mistakes : tuple of FieldMistake
        Mistakes; all other fields are then empty.
    tests : int
        Tests of a study of lives that are done.
    is_last : bool
        Whether further tests would change nothing.
    page : str
        HTML of a report.
    """

    title: str = ""
    question: str = ""
    basis: str = ""
    rows: tuple[Quantity, ...] = ()
    remarks: tuple[str, ...] = ()
    panels: dict[str, Drawn] | None = None
    steps: tuple[str, ...] = ()
    mistakes: tuple[FieldMistake, ...] = ()
    tests: int = 0
    is_last: bool = False
    page: str = ""

    @property
    def drawn(self) -> dict[str, Drawn]:
        """The panels by name."""
        return self.panels or {}


def answer(
    request: Request,
    stop_requested: Callable[[], bool],
    on_progress: Callable[[int], None] = lambda _: None,
) -> Answer:
    """Return the answer to a request; mistakes of the scenario are returned as an answer.

    Parameters
    ----------
    request : Request
    stop_requested : callable
        True stops the computation.
    on_progress : callable
        Called with the number of tests of lives that are done.

    Raises
    ------
    Interrupted
        If it was stopped.
    """
    try:
        match request.stage:
            case "lives":
                return _lives(request, stop_requested, on_progress)
            case "report":
                return _report(request, stop_requested)
            case _:
                return _test(request, stop_requested)
    except wearsim.Interrupted:
        raise
    except wearsim.ScenarioError as error:
        mistakes = [FieldMistake(item.table, item.key, str(item)) for item in error.mistakes]
        return Answer(mistakes=tuple(mistakes))
    # the last two are those of arguments that the scenario does not allow
    except (wearsim.WearsimError, ValueError, TypeError) as error:
        return Answer(mistakes=(FieldMistake("", "", str(error)),))


def _test(request: Request, stop_requested: Callable[[], bool]) -> Answer:
    """Return the wear test of a scenario, or its cam or contact if it has no test."""
    coarse = request.stage == "first"
    further = _coarser(request.design) if coarse else None
    scenario = request.design.scenario(further, comments=not coarse)
    views: list[Any] = []
    if scenario.wear is not None and scenario.has_length:
        views.append(wearsim.run(scenario, stop_requested=stop_requested).view)
    if scenario.cam is not None:
        views.append(wearsim.study_cam(scenario).view)
    if not views:
        views.append(wearsim.study_contact(scenario).view)
    main, panels = views[0], dict[str, Drawn]()
    steps: Sequence[str] = ()
    for view in views:
        shown, texts = panels_of(view.panels())
        steps = steps or texts
        prefix = "" if view is main else "cam "
        panels |= {f"{prefix}{name}": Drawn(panel, record(panel)) for name, panel in shown.items()}
    if (moving := main.animation()) is not None:
        numbers = range(0, moving.count, _EVERY)
        first = numbers[request.frame % len(numbers)] if coarse else numbers[0]
        frames = [] if coarse else [record(_without_text(moving.frame(n))) for n in numbers]
        panel = _without_text(moving.frame(first))
        panel = replace(panel, title="Turning cam", caption=panel.title)
        panels = {"turning": Drawn(panel, record(panel), tuple(frames)), **panels}
    return _answer(views, panels, steps)


def _coarser(design: Design) -> dict[str, object] | None:
    """Return the changes for a first answer; None if the tolerance is not below that of these."""
    table = design.tables.get("evolution", {})
    tolerance = table.get("tolerance", 0.0) if isinstance(table, dict) else None
    is_smaller = isinstance(tolerance, float) and 0.0 <= tolerance < COARSE["evolution.tolerance"]
    return dict(COARSE) if is_smaller else None


def _without_text(panel: Panel) -> Panel:
    """Return a panel without texts, which an animation does not move."""
    return replace(panel, marks=[mark for mark in panel.marks if not isinstance(mark, Text)])


def _answer(views: Sequence[Any], panels: dict[str, Drawn], steps: Sequence[str]) -> Answer:
    main = views[0]
    remarks = [text for view in views for text in (view.failures, *view.warnings, *view.notes)]
    return Answer(
        main.title,
        main.question,
        main.basis,
        tuple(Quantity(row.label, row.text) for row in main.rows()),
        tuple(dict.fromkeys(filter(None, remarks))),
        panels,
        tuple(steps),
    )


def has_lives(design: Design) -> bool:
    """Return whether lives can be computed: there are limits, random inputs and a wear law."""
    try:
        scenario = design.scenario()
    except wearsim.WearsimError:
        return False
    return bool(scenario.limit.given and scenario.random and scenario.wear)


def _lives(
    request: Request,
    stop_requested: Callable[[], bool],
    on_progress: Callable[[int], None],
) -> Answer:
    """Return lives: of the scatter of the wear factor alone, or of a number of tests."""
    scenario, remark = request.design.scenario(), ""
    path = request.scratch / f"{request.session}-{request.number}.h5"
    options: dict[str, Any] = {
        "scheduler": "serial",
        "stop_requested": stop_requested,
        "on_progress": lambda progress: on_progress(progress.done),
    }
    other_inputs = [item for item in scenario.random if not item.name.startswith("wear.")]
    result: wearsim.EnsembleResult
    if request.tests == 0:
        if len(other_inputs) == len(scenario.random):
            return Answer(tests=0)  # the wear factor does not scatter
        if other_inputs:
            remark = "Only the wear factor scatters here; the other random inputs have their means."
            scenario = _with_means(request.design, other_inputs)
        result = wearsim.life(scenario, 1, **options)
    elif path.exists():
        result = wearsim.resume_ensemble(path, **options)  # the tests that were stopped
        if result.count < request.tests:
            result = wearsim.resume_ensemble(path, realisations=request.tests, **options)
    else:
        result = wearsim.life(scenario, request.tests, path, **options)
    shown, _ = panels_of(result.view.panels())
    drawn = {f"life {name}": Drawn(panel, record(panel)) for name, panel in shown.items()}
    done = _answer([result.view], drawn, ())
    remarks = (remark, *done.remarks) if remark else done.remarks
    last = not other_inputs or request.tests >= MOST_TESTS
    return replace(done, remarks=remarks, tests=result.count if other_inputs else 1, is_last=last)


def _with_means(design: Design, inputs: Sequence[Any]) -> wearsim.Scenario:
    """Return the scenario with random inputs at their means, without those drawn jointly."""
    for item in inputs:
        value: object = None
        if len(item.mean) == 1:
            mean = item.mean[0]
            value = item.quantity.write(mean) if item.quantity else mean
        design = design.with_change(item.name, value)
    return design.scenario()


def _report(request: Request, stop_requested: Callable[[], bool]) -> Answer:
    """Return the page on the test, as `wearsim report` writes it."""
    result = wearsim.run(request.design.scenario(), stop_requested=stop_requested)
    path = request.scratch / f"{request.session}.html"
    wearsim.save_report([result], path)
    page = path.read_text(encoding="utf-8")
    path.unlink()
    return Answer(result.title, page=page)
