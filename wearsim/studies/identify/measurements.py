"""Measured tests: files named on the command line, and the tables of a tests file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.profiles import ProfileChoice
from wearsim.quantities import quantity
from wearsim.scenario.parse.mistakes import nearest
from wearsim.scenario.parse.overrides import as_toml, flat
from wearsim.units import QuantityError, as_written

#: Short names of inputs.
SHORT = {
    "load": "load.normal_force",
    "friction": "friction.coefficient",
    "creepage": "creepage.longitudinal",
    "yaw": "creepage.yaw",
    "tilt": "creepage.tilt",
    "stiffness": "load.stiffness",
}
_ROWS = ("row", "mean_rows", "row_at")
_KEYS = (
    *("profile", "depth", "depth_std", "lift", "before", "angle", "at", "group", "set", "std"),
    *("body", "shoulders", "curvature", "runout", "columns", "units", *_ROWS),
)
_EXAMPLE = '[[test]] tables with profile = "t1.csv", or depth = "48 um" and depth_std = "1 um"'


@dataclass(frozen=True)
class Measurement:
    """One measured groove.

    Parameters
    ----------
    name : str
        File, or "test 2".
    profile, before : Path, optional
        Files of the worn profile, and of the same place before the test.
    choice : ProfileChoice
        Columns, units and rows of these files.
    depth, depth_std : float, optional
        Measured depth instead of a profile, and its standard deviation [m].
    at : str, optional
        Time or passes of the measurement; the end of the test by default.
    group : str, optional
        Name of the specimen.
    values : mapping of str to object
        Known inputs of this test, by the scenario's key.
    errors : mapping of str to object
        Standard deviations of measured inputs, by key.
    body : {"cylinder", "roller"}
        Body of which the wear was measured.
    shoulders : float, optional
        Distance from the middle of the groove beyond which the surface is unworn [m].
    curvature : bool
        Whether the trace has an unknown curvature, as of a bow of the instrument's guide.
    angle : float, optional
        Angle of the cam at which the groove was measured [rad].
    lift : Path, optional
        File of the lift of the worn cam, instead of a profile; `before` is of the unworn cam.
    runout : bool
        Whether the lifts differ by an unknown run-out too, since the cam was mounted again.
    file, place : str
        Tests file and "test 2", for messages; empty without such a file.
    """

    name: str
    profile: Path | None = None
    before: Path | None = None
    choice: ProfileChoice = field(default_factory=ProfileChoice)
    depth: float | None = None
    depth_std: float | None = None
    at: str | None = None
    group: str | None = None
    values: Mapping[str, object] = field(default_factory=dict)
    errors: Mapping[str, object] = field(default_factory=dict)
    body: str = "cylinder"
    shoulders: float | None = None
    curvature: bool = False
    angle: float | None = None
    lift: Path | None = None
    runout: bool = False
    file: str = ""
    place: str = ""

    @property
    def files(self) -> list[Path]:
        """Files of the measurement."""
        return [path for path in (self.profile, self.lift, self.before) if path is not None]

    @property
    def surface(self) -> str:
        """Name of what was measured: a body, a body at an angle of the cam, or the lift."""
        if self.lift is not None:
            return "lift"
        at = "" if self.angle is None else f" at {math.degrees(self.angle):.9g} deg"
        return f"{self.body}{at}"

    def refused(self, *mistakes: Mistake) -> ScenarioError:
        """Return the error of mistakes in the test, which names the tests file and the test."""
        return ScenarioError(
            self.file or self.name, [replace(mistake, table=self.place) for mistake in mistakes]
        )


def key_of(name: str) -> str:
    """Return the scenario's key of an input, which may be given by a short name."""
    return SHORT.get(name, name)


def measurements_of(
    files: Sequence[str | Path],
    before: Sequence[str | Path] = (),
    choice: ProfileChoice | None = None,
    shoulders: float | None = None,
    curvature: bool = False,
) -> list[Measurement]:
    """Return the measurements in profile files, each of one test.

    Parameters
    ----------
    files, before : sequence of path
        Profiles after the tests, and before them if they were measured.
    choice : ProfileChoice, optional
        Columns, units and rows of all files.
    shoulders, curvature
        As in `Measurement`.

    Raises
    ------
    ValueError
        If there are not as many files before as after.
    """
    if before and len(before) != len(files):
        raise ValueError(
            f"{len(before)} profiles before the tests for {len(files)} after them; give one for"
            " each, in the same order"
        )
    firsts: Sequence[str | Path | None] = before or [None] * len(files)
    return [
        Measurement(
            str(file),
            Path(file),
            Path(first) if first is not None else None,
            choice or ProfileChoice(),
            shoulders=shoulders,
            curvature=curvature,
        )
        for file, first in zip(files, firsts, strict=True)
    ]


def read_tests(path: str | Path) -> list[Measurement]:
    """Read a tests file; the files that it names are relative to its folder.

    Parameters
    ----------
    path : path
        TOML with ``[[test]]`` tables.

    Returns
    -------
    list of Measurement

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    file = Path(path)
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise mistake_in(str(path), f"the file cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise mistake_in(str(path), f"is not TOML: {error}") from error
    tests = tables.pop("test", None)
    mistakes = [Mistake("", key, "is unknown", None, _EXAMPLE) for key in tables]
    if not isinstance(tests, list) or not all(isinstance(test, dict) for test in tests or []):
        raise ScenarioError(str(path), [*mistakes, Mistake("", "", "has no tests", None, _EXAMPLE)])
    measurements = [
        _read_test(table, f"test {number}", file, mistakes) for number, table in enumerate(tests, 1)
    ]
    if mistakes:
        raise ScenarioError(str(path), mistakes)
    return measurements


def tables_of(items: Sequence[Measurement]) -> list[dict[str, Any]]:
    """Return the tables of a tests file in the folder of its profiles.

    Parameters
    ----------
    items : sequence of Measurement

    Returns
    -------
    list of dict
        Values as TOML and JSON can hold them.
    """
    files = {path for item in items for path in item.files}
    unique = len({path.name for path in files}) == len(files)

    def name(path: Path | None) -> str | None:
        return None if path is None else path.name if unique else path.as_posix()

    def length(value: float | None) -> str | None:
        return None if value is None else f"{float(value)!r} m"

    tables = []
    for item in items:
        choice = item.choice
        table: dict[str, Any] = {
            "profile": name(item.profile),
            "lift": name(item.lift),
            "before": name(item.before),
            "depth": length(None if item.profile else item.depth),
            "depth_std": length(None if item.profile else item.depth_std),
            "angle": None if item.angle is None else f"{float(item.angle)!r} rad",
            "at": item.at,
            "group": item.group,
            "set": dict(item.values) or None,
            "std": dict(item.errors) or None,
            "body": item.body if item.body != "cylinder" else None,
            "shoulders": length(item.shoulders),
            "curvature": item.curvature or None,
            "runout": item.runout or None,
            "columns": choice.columns,
            "units": choice.units,
            "row": choice.row,
            "mean_rows": choice.mean_rows,
            "row_at": length(choice.at),
        }
        tables.append({key: as_toml(value) for key, value in table.items() if value is not None})
    return tables


def _read_test(
    table: dict[str, Any], place: str, file: Path, mistakes: list[Mistake]
) -> Measurement:
    """Return one test, and add its mistakes."""

    def wrong(key: str, what: str, got: object, expected: str) -> None:
        mistakes.append(
            Mistake(place, key, what, None if got is None else as_written(got), expected)
        )

    def amount(key: str, unit: str, expected: str) -> float | None:
        if key not in table:
            return None
        try:
            return quantity(table[key], unit)
        except QuantityError as error:
            wrong(key, error.what, table[key], expected)
            return None

    def length(key: str) -> float | None:
        value = amount(key, "m", "a length such as '48 um'")
        if value is not None and value <= 0.0:
            wrong(key, "must be above 0", table[key], "a length such as '48 um'")
        return value

    def text(key: str) -> str | None:
        value = table.get(key)
        if value is not None and not isinstance(value, str):
            wrong(key, "is not a text", value, "a text in quotes")
            return None
        return value

    for key in table:
        if key not in _KEYS:
            wrong(key, "is unknown", None, ", ".join(_KEYS))
    for key in ("set", "std"):
        if not isinstance(table.get(key, {}), dict):
            wrong(key, "is not a table", table[key], 'a table such as {load = "310 N"}')
            return Measurement(place)
    of_lift, std = "lift" in table, "its standard deviation, such as '1 um'"
    one, refused = (
        sum(key in table for key in ("profile", "depth", "lift")) == 1,
        ("angle", "body", "shoulders", "curvature"),
    )
    checks: list[tuple[bool, str, str, object, str]] = [
        (not one, "profile, depth or lift", "exactly one of them is needed", None, _EXAMPLE),
        (
            *(of_lift and "before" not in table, "before", "is needed with lift", None),
            "the lift of the unworn cam",
        ),
        *(
            (of_lift and key in table, key, "has no meaning with lift", table.get(key), "")
            for key in (*refused, *_ROWS)
        ),
        (
            *(not of_lift and "runout" in table, "runout", "is of a lift", None),
            "runout with lift only",
        ),
        (
            *("depth" in table and "depth_std" not in table, "depth_std", "is needed with depth"),
            *(None, std),
        ),
        (
            table.get("body", "cylinder") not in {"cylinder", "roller"},
            *("body", "is unknown", table.get("body"), '"cylinder" or "roller"'),
        ),
        *(
            (
                not isinstance(table.get(key, False), bool),
                *(key, "is not true or false", table.get(key), "true or false"),
            )
            for key in ("curvature", "runout")
        ),
    ]
    for applies, *mistake in checks:
        if applies:
            wrong(*mistake)  # type: ignore[arg-type]
    values, errors = (
        {key: value for key, value in flat(table.get(name, {})) if value != {}}
        for name in ("set", "std")
    )
    for key, value in values.items():
        if "." not in key and key not in SHORT:
            expected = f"a key of the scenario such as load.normal_force, or {', '.join(SHORT)}"
            wrong(f"set.{key}", f"is unknown{nearest(key, SHORT)}", value, expected)
    for key, value in errors.items():
        if key_of(key) not in map(key_of, values):
            hint = nearest(key, values) or nearest(key, SHORT)
            expected = "a key of set" if hint else f"{key} in set"
            wrong(f"std.{key}", f"has no measured value in set{hint}", value, expected)
    names = {key: text(key) for key in ("profile", "lift", "before", "at", "group")}
    profile, lift, before = (
        file.parent / name if (name := names[k]) else None for k in ("profile", "lift", "before")
    )
    choice = ProfileChoice()
    try:
        choice = ProfileChoice(
            tuple(table["columns"]) if "columns" in table else None,
            tuple(table["units"]) if "units" in table else None,
            table.get("row"),
            tuple(table["mean_rows"]) if "mean_rows" in table else None,
            quantity(table["row_at"], "m") if "row_at" in table else None,
        )
    except (TypeError, ValueError) as error:
        wrong("columns, units or rows", str(error), None, 'columns = ["y", "-z"], for instance')
    return Measurement(
        _name(names["profile"] or names["lift"] or place, table),
        profile,
        before,
        choice,
        length("depth"),
        length("depth_std"),
        names["at"],
        names["group"],
        {key_of(key): value for key, value in values.items()},
        {key_of(key): value for key, value in errors.items()},
        str(table.get("body", "cylinder")),
        length("shoulders"),
        table.get("curvature") is True,
        amount("angle", "rad", "an angle such as '112 deg'"),
        lift,
        table.get("runout") is True,
        str(file),
        place,
    )


def _name(name: str, table: Mapping[str, Any]) -> str:
    """Return the name of a test, with the angle of a cam."""
    return f"{name} ({table['angle']})" if isinstance(table.get("angle"), str) else name
