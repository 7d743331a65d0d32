"""Fields and sliders of a page, from the schema of scenarios."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import wearsim
from wearsim_explore.fields import Field, Slider, fields_of, slider_of

SCENARIOS = sorted((Path(__file__).parents[3] / "scenarios").glob("*.toml"))


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return wearsim.scenario_schema()


def numbers(value: Any, key: str = "") -> Iterator[str]:
    """Yield the dotted keys of all numbers and quantities of a scenario."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from numbers(item, f"{key}.{name}" if key else name)
    elif isinstance(value, list):
        for place, item in enumerate(value):
            yield from numbers(item, f"{key}.{place}")
    elif not isinstance(value, bool) and (
        isinstance(value, int | float) or (value[:1] in "-.0123456789" and " " in value)
    ):
        yield key


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_number_of_a_shipped_scenario_has_a_field(path: Path, schema: Any) -> None:
    tables = tomllib.loads(path.read_text())
    tables.pop("title", None)
    fields = {field.key: field for field in fields_of(schema, tables)}
    # lists of plain numbers, such as moments, are no values that are dragged
    wanted = [key for key in numbers(tables) if not key.startswith("sampling.correlation")]
    missing = [key for key in wanted if key not in fields and not key.rpartition(".")[2].isdigit()]
    assert not missing
    for key in set(wanted) & set(fields):
        item = fields[key]
        assert item.kind in {"number", "integer", "quantity"}, key
        if item.slider is not None:
            assert item.slider.low <= float(item.value or 0) <= item.slider.high, key


def test_units_and_choices_are_those_of_the_scenario(schema: Any) -> None:
    text = '[roller]\nradius = "2 cm"\n[load]\nkind = "spring"\nstiffness = "690 N/mm"\n'
    fields = {field.key: field for field in fields_of(schema, tomllib.loads(text))}
    radius = fields["roller.radius"]
    assert (radius.value, radius.unit, radius.label) == ("2", "cm", "radius")
    assert "constant" in fields["load.kind"].choices
    assert fields["load.stiffness"].unit == "N/mm"
    assert "cam.base_radius" not in fields


@pytest.mark.parametrize(
    ("text", "written"),
    [("25", "25 mm"), ("1 inch", "1 inch"), ("2.5e1", "2.5e1 mm"), ("wide", "wide")],
)
def test_typed_quantities_have_the_unit_of_the_field(text: str, written: str) -> None:
    assert Field("a.b", "quantity", "", "20", "mm").written(text) == written


def test_typed_numbers_are_written_as_typed() -> None:
    assert Field("a.b", "number", "", "1").written("-1") == -1
    assert Field("a.b", "number", "", "1").written("1e-3") == 1e-3
    assert Field("a.b", "integer", "", "1").written("2.5") == 2.5  # a mistake that is shown
    assert Field("a.b", "flag", "", "true").written("false") is False


def test_ranges_are_logarithmic_above_zero_and_within_bounds() -> None:
    assert slider_of({}, 20.0, 1.0) == Slider(5.0, 80.0, log=True)
    assert slider_of({"maximum": 0.1}, 0.05, 1.0).high == 0.1
    assert slider_of({"exclusiveMinimum": 1.0}, 1.2, 1.0).low == pytest.approx(1.05)
    assert slider_of({}, 0.0, 2.0) == Slider(-8.0, 8.0)
    assert slider_of({}, 0.0, 2.0, signed=False) == Slider(0.0, 8.0)
    assert slider_of({"minimum": 1}, 3.0, 1.0, whole=True) == Slider(1.0, 12.0, log=True, step=1.0)
