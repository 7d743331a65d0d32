"""The table of an ensemble, of made-up realisations."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.report.made_up_ensembles import made_up
from wearsim.cli.render import show_view
from wearsim.studies.ensemble.result import EnsembleResult


def test_insignificant_effect_is_listed_with_its_bound(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = made_up(400, seed=2)
    show_view(found.view, json=False)
    (none,) = [item for item in found.sensitivity() if item.without_effect]
    rows = " ".join(capsys.readouterr().out.split())
    assert f"{none.name} not significant, at most {100.0 * none.first.high:.2g} %" in rows


def test_one_realisation_and_constant_ones_have_no_spread(
    capsys: pytest.CaptureFixture[str],
) -> None:
    show_view(made_up(1).view, json=False, stored=True)
    one = capsys.readouterr().out
    assert "95 % interval" not in one
    assert "Sobol indices of the depth: too few realisations," in one
    show_view(made_up(20, spread=0.0).view, json=False)
    same = capsys.readouterr().out
    assert ["depth", "[um]", "20.00", "constant", "-", "-", "-"] in [
        line.split() for line in same.splitlines()
    ]
    assert "Sobol indices of the depth: none, the depth is equal in all realisations" in same


def test_saltelli_has_total_indices(capsys: pytest.CaptureFixture[str]) -> None:
    found = made_up(5 * 60, "saltelli")
    show_view(found.view, json=False)
    assert " total" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (made_up(20, until="depth.q95 50%"), "not reached: too few realisations"),
        (
            made_up(20, until="roller_depth.mean 5%"),
            "not reached: equal in all 20 realisations, but the sample is too small",
        ),
        (
            made_up(40, until="roller_depth.mean 5%"),
            "reached: equal in all 40 realisations",
        ),
        (
            made_up(20, until="depth.mean 90%"),
            "% with 20 realisations, but the sample is too small",
        ),
    ],
)
def test_target_is_described_by_its_half_width(
    capsys: pytest.CaptureFixture[str], found: EnsembleResult, message: str
) -> None:
    show_view(found.view, json=False)
    output = " ".join(capsys.readouterr().out.split())
    assert f"{message} wall" in output
    assert "within -" not in output


def test_too_few_realisations_name_the_needed_number(
    capsys: pytest.CaptureFixture[str],
) -> None:
    show_view(made_up(10).view, json=False)
    output = capsys.readouterr().out
    number = re.search(r"too few realisations, (\d+) are sufficient", output)
    assert number is not None
    needed = int(number[1])
    assert all(np.isfinite(item.first.value) for item in made_up(needed).sensitivity())
    fewer = made_up(needed - 1)
    (unknown,) = [item for item in fewer.sensitivity() if not np.isfinite(item.first.value)]
    show_view(fewer.view, json=False)
    output = " ".join(capsys.readouterr().out.split())
    assert f"{unknown.name} too few realisations, {needed} are sufficient" in output


def test_needed_number_of_saltelli_counts_whole_rows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    show_view(made_up(5 * 3, "saltelli").view, json=False)
    output = capsys.readouterr().out
    number = re.search(r"too few realisations, (\d+) are sufficient", output)
    assert number is not None
    needed = int(number[1])
    assert needed % 5 == 0
    for count, is_known in ((needed, True), (needed - 5, False)):
        effects = made_up(count, "saltelli").sensitivity()
        assert all(np.isfinite(item.first.value) == is_known for item in effects)
