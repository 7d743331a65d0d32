"""CSV files with units in their headers: columns in SI units, or all mistakes of the file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from wearsim.csv_cells import decode
from wearsim.csv_tables import MAX_ALIKE, MAX_MISTAKES, read_columns
from wearsim.errors import ScenarioError
from wearsim.types import FloatArray

LOG = {"time": "s", "load": "N"}


def _read(text: str) -> dict[str, FloatArray]:
    return read_columns(text, "log.csv", LOG, rising="time")


def _mistakes(text: str) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        _read(text)
    return [str(mistake) for mistake in caught.value.mistakes]


@pytest.mark.parametrize("mark", [",", ";", "\t", " ; "])
def test_columns_are_in_si_for_every_separator(mark: str) -> None:
    rows = [["time [min]", "note", '"load [kN]"'], ["0", "a", "0.3"], ["1.5", "", "-1e-1"]]
    text = "\ufeff# a log\n\n" + "\n# more\n".join(mark.join(row) for row in rows) + "\n\n"
    columns = _read(text)
    assert columns["time"].tolist() == [0.0, 90.0]
    assert columns["load"].tolist() == [300.0, -100.0]


def test_column_can_have_an_alias() -> None:
    text = "y [mm],z [um]\n0,1\n1,-2\n"
    columns = {"y": "m", "height": "m"}
    found = read_columns(text, "p.csv", columns, aliases={"height": ["z"]})
    np.testing.assert_allclose(found["height"], [1e-6, -2e-6], rtol=1e-15)


def test_plain_numbers_need_no_unit() -> None:
    columns = read_columns("n,mu [-]\n1,0.1\n2,0.2\n", "mu.csv", {"n": "1", "mu": "1"})
    assert columns["mu"].tolist() == [0.1, 0.2]
    with pytest.raises(ScenarioError) as caught:
        read_columns("mu [mm]\n1\n2\n", "mu.csv", {"mu": "1"})
    assert str(caught.value) == (
        "mu.csv: line 1: column 'mu': a plain number has no unit, got [mm], expected mu"
    )


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        ("", ["the file is empty, expected a header line such as time [s], load [N]"]),
        (
            "# only words\n",
            ["the file is empty, expected a header line such as time [s], load [N]"],
        ),
        (
            "tim [s],load [N]\n0,1\n1,2\n",
            [
                (
                    "line 1: column 'time' is missing (is it 'tim'?), got tim [s], load [N],"
                    " expected time [s]"
                )
            ],
        ),
        (
            "time [s],force [N]\n0,1\n1,2\n",
            ["line 1: column 'load' is missing, got time [s], force [N], expected load [N]"],
        ),
        (
            "Zeit;Kraft\ns;N\n0;1\n1;2\n",
            [
                "line 1: column 'time' is missing, got Zeit, Kraft, expected time [s]",
                "line 1: column 'load' is missing, got Zeit, Kraft, expected load [N]",
            ],
        ),
        (
            "time,load []\n0,1\n1,2\n",
            [
                "line 1: column 'time' has no unit, got time, expected time [s]",
                "line 1: column 'load' has no unit, got load, expected load [N]",
            ],
        ),
        (
            "time [mm],load [Newton]\n0,1\n1,2\n",
            [
                (
                    "line 1: column 'time': wrong dimension, got mm (a length),"
                    " expected a unit of time such as s"
                ),
                "line 1: column 'load': unknown unit 'Newton', expected a unit of force such as N",
            ],
        ),
        (
            "time [s],load [N],load [kN]\n0,1,2\n1,2,3\n",
            [
                (
                    "line 1: column 'load' appears 2 times, got time [s], load [N], load [kN],"
                    " expected one such column"
                )
            ],
        ),
        (
            'time [s],load [N]\n0,"1,5"\n1,x\n2,\n3\n4,nan\n5,-inf\n6,1_0\n7,1e999\n',
            [
                "line 2: column 'load': needs a decimal point, got '1,5', expected a number",
                "line 3: column 'load': is not a number, got 'x', expected a number",
                "line 4: column 'load': is missing, expected a number",
                "line 5: column 'load': is missing, expected a number",
                "line 6: column 'load': must be finite, got nan, expected a number",
                "line 7: column 'load': must be finite, got -inf, expected a number",
                "line 8: column 'load': is not a number, got '1_0', expected a number",
                "line 9: column 'load': must be finite, got 1e999, expected a number",
            ],
        ),
        (
            "time [s],load [N]\n# then\n0,5,1,5\n1,2\n2,3\n",
            [
                (
                    "line 3: too many cells (is a comma meant as decimal point?), got 4 cells,"
                    " expected 2, as in the header"
                )
            ],
        ),
        (
            "time [s],load [N]\n0,1\n2,1\n2,1\n1,1\n",
            [
                "line 4: column 'time' must increase, got 2, expected more than 2",
                "line 5: column 'time' must increase, got 1, expected more than 2",
            ],
        ),
        ("time [s],load [N]\n0,1\n", ["too few rows of numbers, got 1, expected at least 2"]),
        (
            "0,300\n1,310\n",
            [
                (
                    "line 1: there is no header, got 0,300,"
                    " expected a header line such as time [s], load [N]"
                )
            ],
        ),
        (
            "time/s load/N\n0 1\n1 2\n",
            [
                (
                    "line 1: the header is one column, got time/s load/N,"
                    " expected commas, semicolons or tabs between columns"
                )
            ],
        ),
    ],
)
def test_every_mistake_is_reported_with_its_line(text: str, mistakes: list[str]) -> None:
    assert _mistakes(text) == mistakes


@pytest.mark.parametrize(("cells", "shown"), [("x", MAX_ALIKE), ("{}", MAX_MISTAKES)])
def test_number_of_mistakes_is_limited(cells: str, shown: int) -> None:
    rows = [f"{k},{cells.format('x' if k % 2 else '')}\n" for k in range(50)]
    mistakes = _mistakes("time [s],load [N]\n" + "".join(rows))
    assert len(mistakes) == shown + 1
    assert mistakes[-1] == f"and {50 - shown} more"


@pytest.mark.parametrize("blank", ["", "  ", ",", " , ", ";;"])
def test_rows_of_separators_only_are_blank(blank: str) -> None:
    text = f"time [s],load [N]\n0,1\n{blank}\n1,2\n{blank}\n"
    assert _read(text)["load"].tolist() == [1.0, 2.0]


@given(
    st.lists(
        st.tuples(
            st.floats(allow_nan=False, allow_infinity=False),
            st.floats(allow_nan=False, allow_infinity=False),
        ),
        min_size=2,
    ),
    st.sampled_from([",", ";", "\t"]),
)
def test_numbers_are_read_exactly_as_written(rows: list[tuple[float, float]], mark: str) -> None:
    text = f"a [m]{mark}b [s]\n" + "".join(f"{a!r}{mark}{b!r}\n" for a, b in rows)
    columns = read_columns(text, "t.csv", {"b": "s", "a": "m"})
    assert list(zip(columns["a"], columns["b"], strict=True)) == rows


@given(st.text(alphabet='time load[]sN,;\t\n"#0123456789.e-', max_size=200) | st.text())
def test_any_text_gives_columns_or_a_scenario_error(text: str) -> None:
    try:
        columns = _read(text)
    except ScenarioError as error:
        assert error.mistakes  # noqa: PT017
    else:
        assert np.all(np.diff(columns["time"]) > 0.0)


NUMBERS = st.floats(-1e300, 1e300)
CELLS = st.one_of(
    NUMBERS.map(repr),
    st.sampled_from(
        ["", "nan", "inf", "1e999", "1_0", "0x10", "1,5", "1 2", '"3"', "4 # note", "+.5e-3"]
    ),
)


@given(st.lists(NUMBERS, min_size=2, max_size=8), st.sampled_from([",", ";", "\t"]))
def test_regular_file_reads_as_row_by_row(values: list[float], mark: str) -> None:
    rows = [mark.join((repr(float(k)), "text", repr(value))) for k, value in enumerate(values)]
    text = "\n".join([mark.join(("time [s]", "note", "load [kN]")), *rows])
    quick, slow = _outcome(text), _outcome(text + "\n# a comment line disables the quick reader")
    assert quick == slow


@given(st.lists(st.tuples(CELLS, CELLS), min_size=2, max_size=6))
def test_any_cells_read_as_row_by_row(cells: list[tuple[str, str]]) -> None:
    text = "\n".join(["time [s];load [N]", *(";".join(pair) for pair in cells)])
    assert _outcome(text) == _outcome(text + "\n# a comment line disables the quick reader")


def _outcome(text: str) -> object:
    try:
        return {name: column.tobytes() for name, column in _read(text).items()}
    except ScenarioError as error:
        return [str(mistake) for mistake in error.mistakes]


PROFILE = {"y": "m", "height": "m"}


def _profile(text: str) -> list[list[float]]:
    columns = read_columns(
        text, "p.csv", PROFILE, opposite={"height": "depth"}, rising="y", either_way=True
    )
    return [np.round(1e6 * columns[name], 9).tolist() for name in ("y", "height")]


@pytest.mark.parametrize(
    "head",
    [
        "y [mm],height [um]",
        "y (mm),height (um)",
        "y/mm,height/um",
        "Y [mm],Height [µm]",
        "y in mm,HEIGHT in um",
        "y,height\n[mm],[um]",
        "y,height\nmm,um",
        "# y [mm],height [um]",
    ],
)
def test_units_are_read_as_laboratories_write_them(head: str) -> None:
    assert _profile(f"{head}\n0,1\n1,-2\n") == [[0.0, 1000.0], [1.0, -2.0]]


def test_lines_before_the_header_are_ignored() -> None:
    preamble = "Instrument;T 8000\nDate;2024-05-31\nTip radius;2,0;um\n\nheight, after cleaning\n"
    text = preamble + "No;y [mm];height [um]\n1;0;1\n2;1;-2\n"
    assert _profile(text) == [[0.0, 1000.0], [1.0, -2.0]]


@pytest.mark.parametrize("mark", [";", "\t"])
def test_decimal_commas_are_read_where_the_separator_is_none(mark: str) -> None:
    rows = ["y [mm]|height [um]", "-1|2,5", "0|-1,25e1", "1,5|3"]
    expected = [[-1000.0, 0.0, 1500.0], [2.5, -12.5, 3.0]]
    assert _profile("\n".join(rows).replace("|", mark)) == expected
    rows[2] = "0|1.000,5"
    with pytest.raises(ScenarioError) as caught:
        _profile("\n".join(rows).replace("|", mark))
    assert str(caught.value) == (
        "p.csv: line 3: column 'height': is not a number, got '1.000,5', expected a number with a"
        " decimal comma, as in other rows"
    )


def test_falling_positions_are_returned_in_rising_order() -> None:
    assert _profile("y [mm],height [um]\n2,1\n1,2\n0,3\n") == [
        [0.0, 1000.0, 2000.0],
        [3.0, 2.0, 1.0],
    ]
    with pytest.raises(
        ScenarioError, match="line 4: column 'y' must decrease, got 1, expected less"
    ):
        _profile("y [mm],height [um]\n2,1\n1,2\n1,3\n0,3\n")


def test_depth_is_read_as_negative_height() -> None:
    assert _profile("y [mm],depth [um]\n0,1\n1,2\n")[1] == [-1.0, -2.0]
    with pytest.raises(ScenarioError, match="column 'height' appears 2 times"):
        _profile("y [mm],depth [um],height [um]\n0,1,1\n1,2,2\n")


@pytest.mark.parametrize(
    ("times", "seconds"),
    [
        (["23:59:50", "23:59:59.5", "00:00:05", "00:00:20"], [0.0, 9.5, 15.0, 30.0]),
        (["8:05", "8:06", "8:10", "9:00"], [0.0, 60.0, 300.0, 3300.0]),
        (["0:00:00", "0:59:00", "26:00:00", "26:00:01"], [0.0, 3540.0, 93600.0, 93601.0]),
        (
            ["2024-05-31T23:59:00", "2024-06-01 00:00:00.5", "2024-06-01", "2024-06-01T02:00:01Z"],
            None,
        ),
        (
            [
                "2024-05-31T23:59:00",
                "2024-06-01 00:00:00.5",
                "2024-06-01T00:01",
                "2024-06-01T00:02",
            ],
            [0.0, 60.5, 120.0, 180.0],
        ),
    ],
)
def test_clock_times_count_from_the_first_row(
    times: list[str], seconds: list[float] | None
) -> None:
    text = "time;load [N]\n" + "".join(f"{time};{k},5\n" for k, time in enumerate(times))
    if seconds is None:
        assert "must increase" in _mistakes(text)[0]
        return
    assert _read(text)["time"].tolist() == seconds
    assert _mistakes(text.replace(times[2], "later"))[0].startswith(
        "line 4: column 'time': is not a time, got 'later', expected a"
    )


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_text_is_decoded_from_every_usual_encoding(encoding: str) -> None:
    text = "y [mm],height [µm]\n0,1\n1,2\n"
    assert decode(text.encode(encoding)) == text
