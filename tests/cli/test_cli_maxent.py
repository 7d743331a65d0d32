"""`wearsim maxent`: table, block plot, JSON and figure of a distribution."""

import json
import re
from pathlib import Path

import pytest
from cli_examples import Command

LOAD = ("maxent", "--support", "0", "inf", "--mean", "307", "--std", "32")


def test_table_has_multipliers_and_quantiles(command: Command) -> None:
    result = command(*LOAD)
    assert result.exit_code == 0
    assert result.stderr == ""
    cells = (re.split(" {2,}", line.strip()) for line in result.stdout.splitlines())
    rows = {row[0]: row[1] for row in cells if len(row) == 2}
    assert float(rows["l0"]) == pytest.approx(50.4047, rel=5e-6)
    assert float(rows["l1"]) == pytest.approx(-0.2998047, rel=1e-6)
    assert float(rows["l2"]) == pytest.approx(4.88281e-4, rel=5e-6)
    assert rows["parent normal distribution"] == "mean 307, standard deviation 32"
    assert float(rows["97.5 % quantile"]) == pytest.approx(307.0 + 1.959964 * 32.0, rel=1e-6)


def test_density_is_plotted_in_blocks(command: Command) -> None:
    lines = command("maxent", "--support", "0", "1", "--mean", "0.5", "--std", "0.35").stdout
    drawn = [line[2:] for line in lines.splitlines() if set(line) & set("▁▂▃▄▅▆▇█")]
    assert len(drawn) == 8
    top, bottom = drawn[0].ljust(60), drawn[-1]
    assert bottom == "█" * 60  # nowhere near zero
    assert top == top[::-1]  # symmetric
    assert top.strip(" ") == top  # and highest at both ends


def test_json_is_all_of_stdout(command: Command) -> None:
    result = command(*LOAD, "--json")
    data = json.loads(result.stdout)
    assert result.stderr == ""
    assert data["support"] == [0.0, None]
    assert data["multipliers"]["l1"] == pytest.approx(-0.2998047, rel=1e-6)
    assert data["parent"] == pytest.approx({"mean": 307.0, "std": 32.0})
    assert data["quantiles"]["0.5"] == pytest.approx(307.0)
    assert data["warnings"] == []


def test_negative_limits_and_means_are_accepted(command: Command) -> None:
    result = command("maxent", "--support", "-inf", "-1", "--mean", "-3.5", "--json")
    data = json.loads(result.stdout)
    assert (data["family"], data["std"]) == ("exponential", pytest.approx(2.5))


def test_mean_logarithm_gives_a_gamma_distribution(command: Command) -> None:
    arguments = ("maxent", "--support", "0", "inf", "--mean", "2", "--mean-log", "0.1")
    assert json.loads(command(*arguments, "--json").stdout)["family"] == "gamma"
    assert "l2 log x" in command(*arguments).stdout


def test_spike_gives_a_warning(command: Command) -> None:
    result = command("maxent", "--support", "0", "1", "--mean", "1e-3", "--std", "1.1e-3")
    assert result.exit_code == 0
    assert result.stderr.startswith("warning: the density has a minimum at")


def test_infeasible_moments_are_bad_input_in_one_line(command: Command) -> None:
    result = command("maxent", "--support", "0", "inf", "--mean", "307", "--std", "320")
    assert result.exit_code == 2
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: std 320 is more than mean - low = 307, the limit of")


def test_limit_that_is_no_number_is_bad_input(command: Command) -> None:
    result = command("maxent", "--support", "0", "wide", "--mean", "307")
    assert result.exit_code == 2
    assert "'wide' is not a number" in result.stderr


@pytest.mark.parametrize("known", [("--std", "9e-4"), ("--std", "1.1e-3"), ()])
def test_figure_is_drawn_and_an_existing_one_is_kept(
    command: Command, tmp_path: Path, known: tuple[str, ...]
) -> None:
    figure = tmp_path / "law.png"
    arguments = ("maxent", "--support", "0", "1", "--mean", "1e-3", *known, "-o", figure)
    assert command(*arguments).exit_code == 0
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert command(*arguments).exit_code == 2
    assert command(*arguments, "--force").exit_code == 0


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (("--mean", "1e-300", "--std", "1e-301"), "std 1e-301 is too small to be squared"),
        (("--mean", "1e300", "--std", "1e299"), "mean 1e+300 is too large to be squared"),
        (("--mean", "2", "--mean-log", "3"), "--mean-log 3 is not less than log(mean) = 0.693147"),
        (("--mean-log", "3"), "--mean-log 3 needs the mean too"),
        (("--mean", "nan"), "mean must be finite, got nan"),
    ],
)
def test_error_names_options_and_values_as_typed(
    command: Command, known: tuple[str, ...], message: str
) -> None:
    result = command("maxent", "--support", "0", "inf", *known)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"error: {message}")


@pytest.mark.parametrize("std", ["0.5", "0.35", "0.7"])
def test_rounding_errors_are_zero(command: Command, std: str) -> None:
    arguments = ("maxent", "--support", "-1", "1", "--mean", "0", "--std", std)
    data = json.loads(command(*arguments, "--json").stdout)
    assert (data["mean"], data["quantiles"]["0.5"], data["multipliers"]["l1"]) == (0.0, 0.0, 0.0)
    assert "e-1" not in command(*arguments).stdout


def test_small_value_is_not_rounded(command: Command) -> None:
    arguments = ("maxent", "--support", "0", "inf", "--mean", "1e-14", "--std", "1e-15", "--json")
    assert json.loads(command(*arguments).stdout)["quantiles"]["0.5"] == pytest.approx(1e-14)
