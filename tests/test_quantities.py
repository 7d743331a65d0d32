"""Quantities with units: conversion to SI floats, and messages for invalid text."""

from __future__ import annotations

import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, strategies as st
from pydantic import TypeAdapter, ValidationError

from wearsim import units
from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Options
from wearsim.quantities import (
    Angle,
    InputFile,
    Length,
    NonNegativeTorque,
    PerPower,
    PerRoller,
    PositiveDuration,
    PositiveLength,
    Pressure,
    RotationSpeed,
    Speed,
    Stiffness,
    Torque,
    WearFactor,
    quantity,
)
from wearsim.units import QuantityError, as_written, conversion, in_engineers_unit

LENGTH = 'expected a length such as "20 mm"'


@pytest.mark.parametrize(
    ("kind", "text", "si"),
    [
        (Length, "20 mm", 0.02),
        (Length, "-3 um", -3e-6),
        (Length, "3 µm", 3e-6),
        (Length, "3 μm", 3e-6),
        (Length, "3micrometer", 3e-6),
        (Length, "1.5e2 nm", 1.5e-7),
        (Stiffness, "690 N/mm", 690e3),
        (Pressure, "200 GPa", 200e9),
        (WearFactor, "1.1e-11 1/Pa", 1.1e-11),
        (WearFactor, "1.1e-11 /Pa", 1.1e-11),
        (WearFactor, "0.007 mm^3/J", 7e-12),
        (WearFactor, "0.007 mm³/(N m)", 7e-12),
        (WearFactor, "7e-12 m^3/J", 7e-12),
        (RotationSpeed, "1000 rpm", 1000 * math.tau / 60),
        (RotationSpeed, "2 turn/s", 2 * math.tau),
        (RotationSpeed, "3 rad/s", 3.0),
        (PositiveDuration, "450 min", 27000.0),
        (PositiveDuration, "1.5 days", 129600.0),
        (Angle, "0 mrad", 0.0),
        (Angle, "2 mrad", 0.002),
        (Angle, "90°", math.pi / 2),
        (Torque, "0.5 N*mm", 5e-4),
        (Torque, "0.5 N mm", 5e-4),
        (Torque, "0.5 Nmm", 5e-4),
        (Torque, "0.5 N·mm", 5e-4),
        (Speed, "2.6 m/s", 2.6),
        (PerPower, "50 N/W", 50.0),
    ],
)
def test_quantity_becomes_the_nearest_si_float(kind: object, text: str, si: float) -> None:
    assert TypeAdapter(kind).validate_python(text) == pytest.approx(si, rel=3e-16, abs=0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("20", f'needs a unit, got "20", {LENGTH}'),
        ("", f'is not a quantity, got "", {LENGTH}'),
        ("mm", f'is not a quantity, got "mm", {LENGTH}'),
        ("twenty mm", f'is not a quantity, got "twenty mm", {LENGTH}'),
        ("20,5 mm", f'needs a decimal point, got "20,5 mm", {LENGTH}'),
        ("nan mm", f'must be finite, got "nan mm", {LENGTH}'),
        ("-inf mm", f'must be finite, got "-inf mm", {LENGTH}'),
        ("1e999 mm", f'must be finite, got "1e999 mm", {LENGTH}'),
        ("1e999999999 mm", f'must be finite, got "1e999999999 mm", {LENGTH}'),
        ("1e308 km", f'must be finite, got "1e308 km", {LENGTH}'),
        ("20 MPa", f'wrong dimension, got "20 MPa" (a pressure), {LENGTH}'),
        ("20 m^7", f'wrong dimension, got "20 m^7" (a quantity in m^7), {LENGTH}'),
        ("20 mm/mm", f'wrong dimension, got "20 mm/mm" (a plain number), {LENGTH}'),
        ("20 mmm", f"unknown unit 'mmm' (did you mean 'mm'?), got \"20 mmm\", {LENGTH}"),
        ("20 MM", f"unknown unit 'MM' (did you mean 'mm'?), got \"20 MM\", {LENGTH}"),
        ("20 ml", f"unknown unit 'ml', got \"20 ml\", {LENGTH}"),
        ("20 furlong", f"unknown unit 'furlong', got \"20 furlong\", {LENGTH}"),
        ("20 N/", f"'N/' is not a unit, got \"20 N/\", {LENGTH}"),
        ("20 (mm", f"'(mm' is not a unit, got \"20 (mm\", {LENGTH}"),
        ("20 mm 3", f"'mm 3' is not a unit, got \"20 mm 3\", {LENGTH}"),
        ("2 m^9^9^9", f"'m^9^9^9' is not a unit, got \"2 m^9^9^9\", {LENGTH}"),
        ("2 (m^9)^9", f"'(m^9)^9' is not a unit, got \"2 (m^9)^9\", {LENGTH}"),
    ],
)
def test_malformed_quantity_is_refused_with_the_right_form(text: str, message: str) -> None:
    with pytest.raises(QuantityError) as caught:
        quantity(text, "m")
    assert str(caught.value) == message


def test_hertz_is_refused_as_ambiguous() -> None:
    with pytest.raises(QuantityError) as caught:
        quantity("16 Hz", "rad/s")
    assert str(caught.value) == (
        "unknown unit 'Hz' (turns or radians? write rpm, turn/s or rad/s), got \"16 Hz\","
        ' expected a rotation speed such as "1000 rpm"'
    )


def test_units_of_workshops_are_known() -> None:
    assert quantity("1000 U/min", "rpm") == 1000.0
    assert quantity("30 kgf", "N") == pytest.approx(294.1995, rel=1e-15)
    assert quantity("1 bar", "Pa") == 1e5
    assert quantity("1 inch", "mm") == 25.4
    assert quantity("1 psi", "Pa") == pytest.approx(6894.757293168361, rel=1e-15)


def test_one_per_second_is_not_a_rotation_speed() -> None:
    with pytest.raises(ValueError, match="wrong dimension"):
        quantity("16 1/s", "rad/s")


def test_quantity_can_be_converted_to_any_unit() -> None:
    assert quantity("7.5 h", "min") == 450.0


def test_conversion_error_names_both_dimensions() -> None:
    assert conversion("kN", "N") == 1000
    with pytest.raises(QuantityError) as caught:
        conversion("mm", "N")
    assert str(caught.value) == (
        "wrong dimension, got mm (a length), expected a unit of force such as N"
    )


class Both(Options):
    length: PositiveLength = 0.5
    torque: NonNegativeTorque | None = None
    offset: PerRoller[Length] = 0.0


def _error(**values: object) -> list[tuple[tuple[int | str, ...], str]]:
    with pytest.raises(ValidationError) as caught:
        Both.model_validate(values)
    return [(item["loc"], str(item["ctx"]["error"])) for item in caught.value.errors()]


def test_bounds_are_enforced() -> None:
    assert _error(length="0 mm", torque="-1 Nm") == [
        (
            ("length",),
            f'must be above zero, got "0 mm", {LENGTH.replace("such", "above zero such")}',
        ),
        (
            ("torque",),
            (
                'must not be negative, got "-1 Nm", expected a torque of zero or more such as'
                ' "0.5 N mm"'
            ),
        ),
    ]


@pytest.mark.parametrize("value", [20, 20.0, True, None, {"value": 20}])
def test_values_other_than_text_are_refused(value: object) -> None:
    [(place, message)] = _error(length=value)
    assert place == ("length",)
    assert message.endswith('expected a length above zero such as "20 mm"')


def test_value_per_roller_is_a_float_or_a_tuple() -> None:
    assert Both.model_validate({"offset": "1 mm"}).offset == 0.001
    assert Both.model_validate({"offset": ["-1 mm", "1 m"]}).offset == (-0.001, 1.0)


def test_every_bad_value_of_a_list_is_reported_with_its_index() -> None:
    assert _error(offset=["1", "2 mm", "3 N"]) == [
        (("offset", 0), f'needs a unit, got "1", {LENGTH}'),
        (("offset", 2), f'wrong dimension, got "3 N" (a force), {LENGTH}'),
    ]


def test_options_survive_a_json_round_trip() -> None:
    both = Both.model_validate({"length": "3 mm", "offset": ["1 um", "-7 mm"]})
    assert both.model_dump_json() == (
        '{"length":"0.003 m","torque":null,"offset":["1e-06 m","-0.007 m"]}'
    )
    assert Both.model_validate_json(both.model_dump_json()) == both


def test_json_schema_requires_text_with_a_unit() -> None:
    schema = Both.model_json_schema()["properties"]["length"]
    assert schema["type"] == "string"
    assert schema["examples"] == ["20 mm"]
    import re

    (signed,) = (
        option["pattern"]
        for option in Both.model_json_schema()["properties"]["offset"]["anyOf"]
        if "pattern" in option
    )
    for good in ("20 mm", "20mm", "1.1e-11 1/Pa", "5 (N)", "90°"):
        assert re.search(schema["pattern"], good), good
        assert re.search(signed, good), good
    for bad in ("20", "1e3", "mm", ""):
        assert not re.search(schema["pattern"], bad), bad
        assert not re.search(signed, bad), bad
    assert re.search(signed, "-3 µm")
    assert not re.search(schema["pattern"], "-3 µm")  # a positive length


@given(
    number=st.floats(allow_nan=False, allow_infinity=False, max_value=1e300, min_value=-1e300),
    unit=st.sampled_from([("mm", Fraction(1, 1000)), ("km", Fraction(1000)), ("m", Fraction(1))]),
)
def test_result_is_exact_to_the_last_bit(number: float, unit: tuple[str, Fraction]) -> None:
    name, size = unit
    assert quantity(f"{number!r} {name}", "m") == float(Fraction(repr(number)) * size)


@given(st.text(alphabet="0123456789.eE+-^*/() mNPasJ,µ\n", max_size=40) | st.text(max_size=40))
def test_any_text_gives_a_finite_number_or_a_value_error(text: str) -> None:
    try:
        assert math.isfinite(quantity(text, "m"))
    except ValueError as error:
        assert "expected a length" in str(error)  # noqa: PT017


class Named(Options):
    file: InputFile


def _named(value: object, context: dict[str, object] | None) -> str:
    with pytest.raises(ValidationError) as caught:
        Named.model_validate({"file": value}, context=context)
    return str(caught.value.errors()[0]["ctx"]["error"])


def test_input_file_is_read_through_the_context() -> None:
    named = Named.model_validate({"file": "a.csv"}, context={"read": {"a.csv": "text"}.__getitem__})
    assert named.file == InputFile("a.csv", "text")
    assert named.model_dump_json() == '{"file":"a.csv"}'


def test_unreadable_file_is_reported() -> None:
    def missing(path: str) -> str:
        raise FileNotFoundError(2, "No such file or directory", path)

    def damaged(path: str) -> str:
        raise ScenarioError(path, [Mistake("", "", "is no SDF file")])

    read = {"read": missing}
    assert _named("a.csv", read) == (
        'the file cannot be read, got "a.csv" (No such file or directory)'
    )
    assert _named("a.csv", {"read": {}.__getitem__}) == 'the file cannot be read, got "a.csv"'
    assert _named("a.csv", {"read": damaged}) == 'is no SDF file, got "a.csv"'
    assert _named("a.csv", None) == 'no file can be read here, got "a.csv"'
    assert _named(3, read) == (
        'is not a file name, got 3, expected the name of a text file such as "load.csv"'
    )


def test_long_values_are_abbreviated_in_messages() -> None:
    assert as_written("x" * 100) == f'"{"x" * 56}...'
    assert as_written([True, "a", 1.5]) == '[true, "a", 1.5]'


_NAMES = st.sampled_from(sorted(units._UNITS))
_FACTORS = st.one_of(
    st.just("1"), _NAMES, st.builds("{}^{}".format, _NAMES, st.sampled_from([-2, -1, 2, 3]))
)


@given(st.lists(_FACTORS, min_size=1, max_size=4), st.data())
def test_products_of_units_are_measured_as_by_pint(factors: list[str], data: st.DataObject) -> None:
    text = factors[0]
    for factor in factors[1:]:
        text += data.draw(st.sampled_from([" ", "*", "/", " / "])) + factor
    assert units.measure(text) == units._measured_by_pint(text, text)


def test_usual_scenario_does_not_load_pint() -> None:
    file = Path(__file__).parents[1] / "scenarios" / "rig-450min.toml"
    code = f"import sys, wearsim; wearsim.load_scenario(r'{file}'); print('pint' in sys.modules)"
    output = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert output.stdout.strip() == "False"


def test_importing_quantities_does_not_load_pint() -> None:
    code = "import sys, wearsim.quantities, wearsim.csv_tables; print('pint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0125, "m", "12.5 mm"),
        (6.9e5, "N/m", "690 N/mm"),
        (-2e-4, "rad", "-0.2 mrad"),
        (1.1e-11, "1/Pa", "1.1e-11 1/Pa"),
        (0.1, "1", "0.1"),
        (0.0, "m", "0"),
        (math.inf, "N", "inf"),
    ],
)
def test_si_value_is_written_in_engineering_units(value: float, unit: str, text: str) -> None:
    assert in_engineers_unit(value, unit) == text
