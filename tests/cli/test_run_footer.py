"""The line that every run ends with: what it used, how far off it may be, how long it took."""

import json
import re

import pytest

import wearsim

TIME = r"[\d.]+ (us|ms|s)"
RANDOM = "friction.coefficient={distribution = 'uniform', low = 0.09, high = 0.11}"


def last_line(told):
    assert told.exit_code == 0, told.output
    return told.stdout.rstrip().splitlines()[-1]


def test_that_a_run_ends_with_its_own_line(command, scenario):
    line = last_line(command("run", scenario, "-o", "short.h5", "-q"))
    result = wearsim.open_results("short.h5")
    used = f"slender, {len(result.y)} strips, implicit, tolerance 0.001"
    assert line.startswith(f"{used}; by its steps depth within ")
    assert re.search(rf"volume within [\d.]+ % as estimated; {TIME}$", line)
    part = float(re.search(r"depth within ([\d.]+) %", line)[1])
    stated = float(result.depth_error[-1] / result.depth[-1])
    assert part == pytest.approx(100.0 * stated, rel=0.05)


def test_that_single_passes_have_no_error_of_steps(command, scenario):
    changes = ("--set", "evolution.stepper=per-pass", "--set", "operation.passes=30")
    line = last_line(command("run", scenario, "-o", "short.h5", "-q", *changes))
    assert "per-pass; every pass by itself; " in line


def test_that_one_contact_tells_what_its_strips_leave(command, scenario):
    line = last_line(command("contact", scenario))
    error = float(
        re.match(r"slender, 121 strips; by its strips power within ([\d.e-]+) %", line)[1]
    )
    told = json.loads(command("contact", scenario, "--json").stdout)
    assert 100.0 * told["power_error_W"] / told["power_W"] == pytest.approx(error, rel=0.05)
    fine = json.loads(command("contact", scenario, "--json", "--set", "contact.strips=961").stdout)
    assert abs(fine["power_W"] - told["power_W"]) < told["power_error_W"]
    assert told["solve_seconds"] > 0.0


def test_that_studies_end_with_theirs(command, scenario):
    one = last_line(command("dissipation", scenario, "-n", 20, "-q", "--set", RANDOM))
    assert re.search(
        rf"monte-carlo, 20 realisations; mean power within .* % \(95 %\); {TIME}$", one
    )
    serial = ("-n", 3, "-q", "--scheduler", "serial", "--set", RANDOM)
    line = last_line(command("ensemble", scenario, *serial))
    assert re.search(rf"3 realisations; mean depth within .* % \(95 %\), .*; {TIME}$", line)
