"""Conversions on the page of published wear factors."""

from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).parents[3] / "docs" / "wear-factors.md"
STEEL = 7850.0  # kg/m^3
OF_ENERGY = 1e-9 / STEEL * 1e9  # of a rate in ug/J, as K/H in mm^3/J


@pytest.fixture(scope="module")
def rows() -> dict[str, list[str]]:
    """Cells of the first table by the published value, the third column."""
    lines = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line[:2] == "| "]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {row[2]: row for row in cells if len(row) == 6}


@pytest.mark.parametrize(
    ("published", "factors"),
    [
        ("5.3 ug/(m mm^2) per N/mm^2", [5.3 * OF_ENERGY]),
        ("55 ug/(m mm^2)", [55.0 / 10.4 * OF_ENERGY, 55.0 / 77.2 * OF_ENERGY]),
        ("61.9 ug/(m mm^2) for each further N/mm^2", [61.9 * OF_ENERGY]),
    ],
)
def test_rates_per_energy_are_divided_by_density(rows, published, factors):
    assert rows[published][4] == " to ".join(
        f"{factor:.1e}".replace("e-0", "e-") for factor in factors
    )


def test_coefficients_are_divided_by_hardness_and_friction(rows):
    row = rows["K = 1e-4, H = 2940 MPa"]
    rate = 1e-4 / 2940e6 * 1e9
    assert float(row[3]) == pytest.approx(rate, rel=0.01)
    assert float(row[4].split()[1]) == pytest.approx(rate / 0.5, rel=0.01)
    widest = rows["Archard's K from 1e-2 to 1e-6 and lower"][3].split()
    assert [float(widest[0]), float(widest[2])] == pytest.approx([1e-2 / 2.0, 1e-6 / 2.0])


def test_unit_and_scatter_of_the_text_are_converted():
    text = PAGE.read_text(encoding="utf-8")
    assert f"1 ug/J is {OF_ENERGY:.2e}".replace("e-0", "e-") in text
    assert f"standard deviation of {5.0 * np.sqrt(21.0):.0f} %" in text
