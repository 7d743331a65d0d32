"""Peak pressure of fresh logarithmic rollers by the number of strips, as a Markdown table.

``python -m tests.benchmarks.axial_profiles -o out/axial-profiles.json``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.benchmarks.table import save_tables
from wearsim import load_scenario, solve_contact
from wearsim_bench.figures.table import markdown_table

TITLE = "Peak pressure of logarithmic rollers by the number of strips"
SCENARIO = Path(__file__).parents[2] / "scenarios" / "roller-logarithmic.toml"
STRIPS = (65, 125, 245, 485, 965)
FORM = "roller.axial_profile"
_LOAD = {"form": "logarithmic", "design_load": "3 kN"}
#: forms by label
FORMS = {
    "Lundberg": {**_LOAD, "variant": "lundberg"},
    "Johns and Gohar": _LOAD,
    "K1 1.5, K2 0.8, z_m 20 um": {**_LOAD, "k1": 1.5, "k2": 0.8, "drop": "20 um"},
    "K1 2, K2 0.6, z_m 40 um": {**_LOAD, "k1": 2.0, "k2": 0.6, "drop": "40 um"},
}
TILTS = ("0 mrad", "0.5 mrad")


def peak_pressure(form: dict[str, object], tilt: str, strips: int, model: str = "slender") -> float:
    """Return the peak pressure of the fresh contact [Pa]."""
    changes = {FORM: form, "creepage.tilt": tilt, "contact.strips": strips, "contact.model": model}
    return solve_contact(load_scenario(SCENARIO, changes)).peak_pressure


def report() -> dict[str, str]:
    """Return the table by its title."""
    rows = []
    for name, form in FORMS.items():
        for tilt in TILTS:
            peaks = [peak_pressure(form, tilt, strips) for strips in STRIPS]
            exact = peak_pressure(form, tilt, STRIPS[-2], "halfspace")
            rows.append([name, tilt, *(f"{peak / 1e6:.0f}" for peak in (*peaks, exact))])
    counts = [f"{strips} strips" for strips in STRIPS]
    heads = ["form", "tilt", *counts, f"`halfspace`, {STRIPS[-2]} strips"]
    about = "Peak pressure [MPa] of the fresh contact of scenarios/roller-logarithmic.toml."
    return {TITLE: f"{markdown_table(heads, rows)}\n\n{about}\n"}


def main(arguments: list[str] | None = None) -> None:
    """Print the table, and write it to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.axial_profiles", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json")
    output = parser.parse_args(arguments).output
    tables = report()
    sys.stdout.write(tables[TITLE])
    if output is not None:
        save_tables(output, "python -m tests.benchmarks.axial_profiles", tables)


if __name__ == "__main__":
    main()
