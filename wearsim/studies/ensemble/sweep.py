"""Runs and ensembles for several values of one key of a scenario."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.errors import Interrupted, ResultsFileError
from wearsim.quantities import NUMBER, quantity
from wearsim.report.frames import concatenated
from wearsim.results.io.files import as_path
from wearsim.results.io.outputs import check_output
from wearsim.results.kinds import kind_of
from wearsim.scenario import Scenario, as_scenario
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.ensemble.api import checked_request, ensemble, named_precision, resume_ensemble
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.run.result import Result, read_results
from wearsim.studies.run.run import resume, run
from wearsim.units import QuantityError, conversion, kind_of as quantity_kind

if TYPE_CHECKING:
    import xarray

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_WITHOUT_SPACE = re.compile(rf"({_NUMBER})([A-Za-zµμ°].*)")
_QUANTITY = re.compile(rf"({_NUMBER})\s*(\S.*)?")
_EXAMPLE = "such as load.normal_force=250N,300N,350N"


class Sweep(list[Any]):
    """Results for several values of one key, in the order of the values.

    Parameters
    ----------
    results : sequence of Result or EnsembleResult
    key : str
        Dotted key of the scenario.
    values : sequence of str
        As in a scenario.

    Examples
    --------
    >>> results = wearsim.sweep("rig.toml", "load.normal_force", ["250 N", "300 N"])
    >>> ends = results.to_xarray()
    >>> [f"{depth * 1e6:.1f} um" for depth in ends["depth"].squeeze().values]
    ['42.6 um', '48.1 um']
    >>> ends["load.normal_force"].values.tolist(), ends["load.normal_force"].attrs["units"]
    ([250.0, 300.0], 'N')
    """

    def __init__(self, results: Iterable[Any], key: str, values: Sequence[str]) -> None:
        super().__init__(results)
        self.key, self.values = key, list(values)

    def to_xarray(self) -> xarray.Dataset:
        """Return the ends of all tests as one dataset, along the key of the sweep.

        It has the variables that do not depend on strips or stations, whose number differs between
        tests; of cams also depth and lift error along the angle.

        Raises
        ------
        ModuleNotFoundError
            If xarray is not installed, which is part of the extra ``wearsim[data]``.
        """
        ends = [_end(result.to_xarray()) for result in self]
        numbers, unit = _numbers(self.values)
        return concatenated(ends, self.key, numbers, unit)


def _end(dataset: xarray.Dataset) -> xarray.Dataset:
    """Return the last step and the last record, without variables along strips and stations."""
    dropped = [
        name for name, item in dataset.variables.items() if {"y", "station"} & set(item.dims)
    ]
    last = {name: -1 for name in ("step", "record") if name in dataset.dims}
    return dataset.drop_vars(dropped).isel(last, drop=True)


def _numbers(values: Sequence[str]) -> tuple[list[Any], str]:
    """Return the values of a key in SI with their unit, or as given where they are no numbers."""
    numbers, units = [], set()
    for value in values:
        number = NUMBER.match(value.strip())
        unit = value.strip()[number.end() :].strip() if number else ""
        if number is None:
            return list(values), ""
        try:
            si = quantity_kind(unit).unit if unit else "1"
            numbers.append(quantity(value, si) if unit else float(number[0]))
        except QuantityError:
            return list(values), ""
        units.add(si)
    return (numbers, units.pop()) if len(units) == 1 else (list(values), "")


def sweep(
    scenario: Scenario | str | Path,
    key: str,
    values: Sequence[object],
    output: str | Path | None = None,
    *,
    realisations: int | None = None,
    on_value: Callable[[str, Path | None], None] | None = None,
    **options: Any,
) -> Sweep:
    """Run a wear test, or an ensemble, for each of several values of one key.

    The random numbers of an ensemble are addressed by the names of the inputs, so that a
    realisation differs between the ensembles in the value only: differences are not affected by
    sampling. What an earlier call left unfinished in files is continued.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file.
    key : str
        Dotted key, "load.normal_force".
    values : sequence
        Values of the key, as in a scenario: "300 N", 0.1.
    output : path, optional
        ``FILE.h5``, for files ``FILE-VALUE.h5``; needed for ensembles.
    realisations : int, optional
        Number of realisations of each ensemble; by default each value is one test.
    on_value : callable, optional
        Called with value and file before each test or ensemble.
    **options
        Options of `run` or `ensemble`, such as ``progress=True``.

    Returns
    -------
    Sweep
        A list of results in the order of the values, with ``to_xarray()`` along the key.

    Raises
    ------
    ResultsFileError
        If a file exists, or belongs to two values.
    ScenarioError, CapabilityError, TypeError, ValueError
        As in `run` or `ensemble`; those known from the arguments before the first one runs.
    Interrupted
        If it was stopped, with the values that are left.

    Examples
    --------
    >>> results = wearsim.sweep("rig.toml", "load.normal_force", ["250 N", "300 N"])
    >>> [f"{result.depth[-1] * 1e6:.1f} um" for result in results]
    ['42.6 um', '48.1 um']
    """
    names, scenarios = scenarios_of(scenario, key, values)
    if realisations is not None and output is None:
        raise TypeError("ensembles are written to files: name one with output")
    return Sweep(
        run_sweep(scenarios, names, realisations, output, on_value=on_value, **options), key, names
    )


def scenarios_of(
    scenario: Scenario | str | Path, key: str, values: Sequence[object]
) -> tuple[list[str], list[Scenario]]:
    """Return the values of a sweep as texts, and the scenario of each; raises as `sweep`."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise TypeError(f"values must be a list, got {values!r}")
    base, names = as_scenario(scenario), [str(value) for value in values]
    if not names:
        raise ValueError("a sweep needs one or more values")
    return names, [base.changed({key: value}) for value in values]


def run_sweep(
    scenarios: Sequence[Scenario],
    values: Sequence[str],
    realisations: int | None,
    output: str | Path | None,
    *,
    on_value: Callable[[str, Path | None], None] | None = None,
    **options: Any,
) -> list[Any]:
    """Run the scenarios of a sweep, one per value; the other parameters as of `sweep`."""
    paths = [None if output is None else path_of(output, value) for value in values]
    if same := [path for path in paths if path is not None and paths.count(path) > 1]:
        raise ResultsFileError(
            f"{same[0]}: would be the file of two values; write them differently"
        )
    scenarios = [with_chosen_model(scenario, test=True) for scenario in scenarios]
    force, resumed = options.get("force", False), []
    for scenario, path in zip(scenarios, paths, strict=True):
        request: tuple[object, ...] = (scenario.sha256,)
        if realisations is not None:
            precision = named_precision(options.get("precision"), options.get("until"))
            checked = checked_request(scenario, realisations, options.get("plan"), precision)
            until = "" if checked.target is None else str(checked.target)
            request += (checked.plan, checked.realisations, until)
        resumed.append(not force and path is not None and _requested(path) == request)
        if path is not None and not resumed[-1]:
            check_output(path, force, scenario.paths)
    # a run continues to its limit; the target of an ensemble is in its file
    dropped = {"force"} if realisations is None else {"force", "plan", "precision", "until"}
    continued = {name: options[name] for name in options.keys() - dropped}
    results: list[Result | EnsembleResult] = []
    for value, scenario, path, is_resumed in zip(values, scenarios, paths, resumed, strict=True):
        if on_value is not None:
            on_value(value, path)
        try:
            if path is not None and is_resumed:
                again = resume if realisations is None else resume_ensemble
                results.append(again(path, **continued))
            elif realisations is None or path is None:
                results.append(run(scenario, path, **options))
            else:
                results.append(ensemble(scenario, realisations, path, **options))
        except Interrupted as stop:
            left = values[len(results) + 1 :]
            rest = f"; not started: {', '.join(left)}" if left else ""
            raise Interrupted(
                f"{stop.message}{rest}",
                python="call sweep again to continue it",
                shell="repeat the command to continue the sweep",
            ) from stop
    return results


def _requested(path: Path) -> tuple[object, ...] | None:
    """Return what identifies the run or ensemble in a file, None for anything else."""
    try:
        if kind_of(path).name == "run":
            return (read_results(path).sha256,)
        data = read_ensemble(path)
    except ResultsFileError:  # another kind of file, which is not overwritten
        return None
    return data.sha256, data.plan, data.requested, data.until


def path_of(output: str | Path, value: str) -> Path:
    """Return the file of one value: 'out/test.h5' and '250 N' give 'out/test-250N.h5'."""
    path = as_path(output)
    joined = re.sub(r"\s+(?=[A-Za-z])", "", value.strip())  # a number and its unit
    plain = re.sub(r"\s+", "_", joined.replace("/", "_per_").replace("%", "percent"))
    plain = re.sub(r"[^\w.+-]+", "", plain)
    return path.with_name(f"{path.stem}-{plain}{path.suffix}")


def parse_sweep(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of a sweep.

    Parameters
    ----------
    text : str
        "load.normal_force=250N,300N"; the space before a unit may be left out.

    Returns
    -------
    key : str
        Dotted key.
    values : tuple of str
        Two or more different values, with a space before the unit.

    Raises
    ------
    ValueError
        If there is no key, an empty value, fewer than two values, or two equal ones.
    """
    key, equals, listed = text.partition("=")
    if not equals or not key.strip():
        raise ValueError(f"'{text}' is not a key with values, expected one {_EXAMPLE}")
    values = tuple(
        _WITHOUT_SPACE.sub(r"\1 \2", value) if _WITHOUT_SPACE.fullmatch(value) else value
        for value in map(str.strip, listed.split(","))
    )
    if not all(values):
        raise ValueError(f"'{text}' has an empty value, expected values {_EXAMPLE}")
    if len(values) < 2:
        raise ValueError(f"'{text}' has one value, expected two or more {_EXAMPLE}")
    for number, value in enumerate(values):
        for before in values[:number]:
            if _are_equal(before, value):
                raise ValueError(f"'{before}' and '{value}' are the same value; remove one")
    return key.strip(), values


def _are_equal(text: str, other: str) -> bool:
    """Return whether two values are equal, also in different units."""
    matches = [_QUANTITY.fullmatch(value) for value in (text, other)]
    if matches[0] is None or matches[1] is None:
        return text == other
    (first, unit), (second, other_unit) = matches[0].groups(), matches[1].groups()
    if not (unit and other_unit):
        return not (unit or other_unit) and float(first) == float(second)
    try:
        factor = conversion(other_unit, unit)
    except ValueError:  # reported when the scenario is read
        return text == other
    return Fraction(first) == Fraction(second) * factor
