"""Valid scenarios: their values and derived quantities."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from scenario_examples import BUILT, GOOD, Parse

from wearsim.errors import ScenarioError
from wearsim.plugins import ContactModel, Load, LoadTerm, WearLaw
from wearsim.scenario import Scenario, parse_scenario, require_run
from wearsim.types import Material


def test_scenario_values_are_in_si(parse: Parse) -> None:
    scenario = parse()
    assert (scenario.title, scenario.seed, scenario.name) == ("a rig", 3, "rig")
    assert (scenario.roller.radius, scenario.roller.crown_radius) == (0.02, 0.5)
    assert scenario.cylinder.radius == 0.025
    assert scenario.cylinder.material == Material(200e9, 0.3)
    assert scenario.operation.speed == pytest.approx(1000 * math.tau / 60)
    assert scenario.load.options.normal_force == 300.0
    assert scenario.wear.options.cylinder.k_over_h == 1.1e-11
    assert scenario.notes == ()


def test_rolling_speed_and_passes_are_derived(parse: Parse) -> None:
    scenario = parse()
    assert scenario.rolling_speed == pytest.approx(2.6179938779914944)
    assert scenario.pass_rate == pytest.approx(50.0)
    assert scenario.total_passes == 1_350_000
    assert scenario.total_time == pytest.approx(27000.0)


def test_number_of_passes_is_an_integer_above_zero(parse: Parse) -> None:
    assert parse(('"450 min"', '"1 us"')).total_passes == 1
    counted = parse(('duration = "450 min"', "passes = 7"))
    assert counted.total_passes == 7
    assert counted.total_time == pytest.approx(0.14)


def test_diameter_is_twice_the_radius(parse: Parse) -> None:
    scenario = parse(
        ('radius = "20 mm"', 'diameter = "40 mm"'),
        ('crown_radius = "500 mm"', 'crown_diameter = "1 m"'),
        ('radius = "25 mm"', 'diameter = "50 mm"'),
    )
    assert (scenario.roller.radius, scenario.roller.crown_radius) == (0.02, 0.5)
    assert scenario.cylinder.radius == 0.025


def test_material_can_be_given_by_its_constants(parse: Parse) -> None:
    steel = 'radius = "20 mm"'
    table = (
        '\n[roller.material]\nyoungs_modulus = "70 GPa"\npoisson_ratio = 0.5\nhardness = "1 GPa"\n'
    )
    text = GOOD.replace(
        'crown_radius = "500 mm"\nmaterial = "steel"\n', 'crown_radius = "500 mm"\n'
    )
    scenario = parse(("\n[cylinder]", f"{table}\n[cylinder]"), text=text)
    assert steel in scenario.text
    assert scenario.roller.material == Material(70e9, 0.5, 1e9)


def test_neglected_coupling_gives_a_note(parse: Parse) -> None:
    soft = '{ youngs_modulus = "3 GPa", poisson_ratio = 0.3 }'
    scenario = parse(
        (
            'radius = "25 mm"   # not the diameter\nmaterial = "steel"',
            f'radius = "25 mm"\nmaterial = {soft}',
        ),
    )
    [note] = scenario.notes
    assert note.startswith("the materials' Dundurs constant is -0.27")


def test_per_roller_returns_one_value_per_roller(parse: Parse) -> None:
    offsets = 'offset = ["-1 mm", "0.3 mm", "1 mm"]\n'
    scenario = parse(("[roller]\n", f"[roller]\n{offsets}"))
    assert scenario.per_roller(scenario.roller.offset) == (-1e-3, 3e-4, 1e-3)
    assert scenario.per_roller(scenario.creepage.tilt) == (0.0, 0.0, 0.0)


def test_cylinder_can_start_from_a_measured_profile(parse: Parse) -> None:
    named = ('radius = "25 mm"', 'radius = "25 mm"\nprofile = "worn.csv"')
    files = {"worn.csv": "y [mm];height [um]\n-1;0\n0;-3\n1;0\n"}
    scenario = parse(named, files=files)
    assert scenario.files == files
    np.testing.assert_allclose(scenario.cylinder.profile.y, [-1e-3, 0.0, 1e-3])
    np.testing.assert_allclose(scenario.cylinder.profile.height, [0.0, -3e-6, 0.0])


def test_terms_are_added_to_a_load(parse: Parse) -> None:
    term = '\n[load.thermal]\ngain = "50 N/W"\ntime_constant = "20 min"\n'
    load = parse(('normal_force = "300 N"\n', f'normal_force = "300 N"\n{term}')).load
    assert [(item.name, item.options.gain) for item in load.terms] == [("thermal", 50.0)]
    assert isinstance(load.built, Load)
    assert BUILT[-1] == load.options
    assert isinstance(load.terms[0].built, LoadTerm)
    assert BUILT[-1] == load.terms[0].options


def test_plugins_are_built_with_their_options(parse: Parse) -> None:
    scenario = parse(('model = "slender"', 'model = "hertz-fastsim"\nmx = 7\nstrips = 41'))
    assert isinstance(scenario.contact.build(None, ()), ContactModel)
    assert BUILT[-1] == scenario.contact.options
    assert isinstance(scenario.wear.built, WearLaw)
    assert BUILT[-1] == scenario.wear.options
    assert (scenario.contact.options.mx, scenario.contact.strips) == (7, 41)


def test_missing_keys_have_default_values(parse: Parse) -> None:
    scenario = parse(('[contact]\nmodel = "slender"\n', ""))
    assert scenario.contact.model == "slender"
    assert (scenario.evolution.stepper, scenario.evolution.tolerance) == ("auto", 1e-3)
    assert (scenario.outputs.records, scenario.outputs.width_threshold) == (20, 1e-6)
    assert parse(('title = "a rig"\nseed = 3\n', "")).title == "rig"


def test_record_schedule_replaces_the_default(parse: Parse) -> None:
    outputs = parse(("[wear]", '[outputs]\nevery = "10 min"\n[wear]')).outputs
    assert (outputs.records, outputs.every_passes, outputs.every) == (None, None, 600.0)


def _single_contact(parse: Parse) -> Scenario:
    text = GOOD[: GOOD.index("[wear]")]
    return parse(('duration = "450 min"\n', ""), text=text)


def test_single_contact_needs_no_duration_and_no_wear_law(parse: Parse) -> None:
    assert _single_contact(parse).wear is None


def test_run_without_duration_and_wear_law_reports_both(parse: Parse) -> None:
    require_run(parse())
    with pytest.raises(ScenarioError) as caught:
        require_run(_single_contact(parse))
    assert str(caught.value) == (
        "rig.toml: [operation] duration or passes: is needed for a run, got none,"
        ' expected one of them, such as duration = "450 min"\n'
        "rig.toml: [wear]: the table is needed for a run,"
        ' expected law = "archard-dissipation" and its options'
    )


def test_stored_scenario_is_read_back_unchanged(parse: Parse) -> None:
    named = ('radius = "25 mm"', 'radius = "25 mm"\nprofile = "worn.csv"')
    files = {"worn.csv": "y [mm];height [um]\n-1;0\n0;-3\n1;0\n"}
    first = parse(named, files=files, overrides={"seed": 5})
    again = parse_scenario(first.text, first.file, first.files.__getitem__)
    assert (again.sha256, again.text, again.files) == (first.sha256, first.text, first.files)
    assert again.seed == 5


def test_digest_depends_on_text_and_files(parse: Parse) -> None:
    named = ('radius = "25 mm"', 'radius = "25 mm"\nprofile = "worn.csv"')
    files = {"worn.csv": "y [mm];height [um]\n-1;0\n0;-3\n1;0\n"}
    changed = {"worn.csv": files["worn.csv"] + "# seen\n"}
    digests = {
        parse().sha256,
        parse(overrides={"seed": 4}).sha256,
        parse(named, files=files).sha256,
        parse(named, files=changed).sha256,
    }
    assert len(digests) == 4


def test_importing_the_package_loads_no_heavy_library() -> None:
    code = (
        "import sys, wearsim.scenario;"
        "heavy = {'pint', 'tomlkit', 'scipy', 'matplotlib', 'numba', 'h5py'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("coefficient = 10 %", "expected a plain number, coefficient = 0.1"),
        (r'profile = "C:\data\p.csv"', r"expected paths with / or, with \, in single quotes"),
        (r'profile = "C:\Users\p.csv"', r"expected paths with / or, with \, in single quotes"),
        ("differential_slip = True", "expected true or false"),
        ("rollers = 3\nrollers = 4", "expected each key and table once in the file"),
    ],
)
def test_invalid_toml_has_its_remedy(line: str, remedy: str) -> None:
    with pytest.raises(ScenarioError, match="is not valid TOML") as caught:
        parse_scenario(f"[table]\n{line}\n", "rig.toml", str)
    assert str(caught.value).endswith(remedy)
