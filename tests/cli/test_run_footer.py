"""The last line of the output of every study: method, error estimate and wall time."""

import json
import re

import pytest

import wearsim
from wearsim.report.text import within

TIME = r"[\d.]+ (us|ms|s)"
RANDOM = "friction.coefficient={distribution = 'uniform', low = 0.09, high = 0.11}"

WITHOUT_STRIPS = ("--set", "evolution.strip_error=false")


def last_line(result):
    assert result.exit_code == 0, result.output
    return result.stdout.rstrip().splitlines()[-1]


def test_footer_of_a_run_has_its_stepping_error(command, scenario):
    line = last_line(command("run", scenario, "-o", "short.h5", "-q"))
    result = wearsim.open_results("short.h5")
    used = f"slender, {len(result.y)} strips, implicit, tolerance 0.001"
    assert line.startswith(f"{used}; depth within ")
    numerical = r"\(estimated numerical error of the steps and strips, not of model or inputs\)"
    assert re.search(rf"worn volume within [\d.]+ % {numerical}; {TIME}$", line)
    pattern = r"depth within ([\d.]+) % \(steps ([\d.e-]+) %, strips ([\d.]+) %\)"
    part, steps, strips = map(float, re.search(pattern, line).groups())
    assert steps + strips == pytest.approx(part, rel=0.05)
    stated = float(result.depth_error[-1] / result.depth[-1])
    assert part == pytest.approx(100.0 * stated, rel=0.05)


def test_error_of_a_deeper_roller_names_the_depth_to_which_it_is_related(command, scenario):
    wears = "wear.roller.k_over_h=1.1e-9 1/Pa"
    few = ("--set", wears, "--set", "contact.strips=21", "--set", "evolution.tolerance=1e-5")
    done = command("run", scenario, "-o", "short.h5", "-q", *few)
    result = wearsim.open_results("short.h5")
    part = 100.0 * result.final["relative_depth_error"]
    assert part == pytest.approx(100.0 * result.depth_error[-1] / result.roller_depth[-1].max())
    related = re.escape(f"{part:.2g}") + r"\d* % of the roller depth"
    assert re.search(f"depth within {related} \\(steps", last_line(done))
    assert re.search(rf"estimated error of depth +[\d.]+ um, {related} *\n", done.stdout)
    warning = f"estimated error of depth.*: {related}.*, above the tolerance of 0.001 %"
    assert any(re.search(warning, text) for text in result.warnings)


def test_error_of_the_volume_is_that_of_the_energy_where_the_roller_wears_more(command, scenario):
    wears = ("wear.cylinder.k_over_h=1e-13 1/Pa", "wear.roller.k_over_h=1e-10 1/Pa")
    few = ("contact.strips=41", "creepage.longitudinal=3e-4")
    changes = [part for change in (*wears, *few) for part in ("--set", change)]
    done = command("run", scenario, "-o", "short.h5", "-q", *changes)
    result = wearsim.open_results("short.h5")
    part = 100.0 * float(result.errors["dissipated_energy"][-1] / result.dissipated_energy[-1])
    stated = float(re.search(r"worn volume within ([\d.]+) %", last_line(done))[1])
    assert stated == pytest.approx(part, rel=0.05)
    size, error = map(
        float, re.search(r"worn volume +([\d.e-]+) ± ([\d.e-]+) mm", done.stdout).groups()
    )
    assert size == pytest.approx(1e9 * result.worn_volume[-1], rel=0.01)
    assert error == pytest.approx(0.01 * part * size, rel=0.05)


@pytest.mark.parametrize(("part", "text"), [(0.012, "1.2 %"), (9e-15, "rounding")])
def test_relative_error_of_round_off_has_no_digits(part, text):
    assert within("worn volume", 5.0 * part, 5.0) == f"worn volume within {text}"


def test_per_pass_run_has_no_stepping_error(command, scenario):
    changes = ("--set", "evolution.stepper=per-pass", "--set", "operation.passes=30")
    line = last_line(command("run", scenario, "-o", "short.h5", "-q", *changes))
    assert "(steps rounding, strips " in line
    line = last_line(command("run", scenario, "-o", "b.h5", "-q", *changes, *WITHOUT_STRIPS))
    assert "per-pass; no stepping error; " in line


def test_strip_error_of_a_contact_bounds_the_difference(command, scenario):
    line = last_line(command("contact", scenario))
    error = float(
        re.match(r"slender, 121 strips; dissipated power within ([\d.e-]+) % \(est", line)[1]
    )
    coarse = json.loads(command("contact", scenario, "--json").stdout)
    assert 100.0 * coarse["power_error_W"] / coarse["power_W"] == pytest.approx(error, rel=0.05)
    fine = json.loads(command("contact", scenario, "--json", "--set", "contact.strips=961").stdout)
    assert abs(fine["power_W"] - coarse["power_W"]) < coarse["power_error_W"]
    assert coarse["solve_seconds"] > 0.0


def test_footers_of_studies_have_their_sampling_error(command, scenario):
    one = last_line(command("dissipation", scenario, "-n", 20, "-q", "--set", RANDOM))
    error = r"mean dissipated power within .* % \(95 % interval\)"
    assert re.search(rf"monte-carlo, 20 realisations; {error}; {TIME}$", one)
    serial = ("-n", 3, "-q", "--scheduler", "serial", "--set", RANDOM)
    line = last_line(command("ensemble", scenario, *serial))
    assert re.search(
        rf"3 realisations; mean depth within .* %, .* \(95 % intervals\); {TIME}$", line
    )
