"""Error messages of invalid scenarios: one line for each mistake, with file, table and key."""

# ruff: noqa: E501  (long messages)

from __future__ import annotations

from pathlib import Path

import pytest
from scenario_examples import GOOD, RIG, Parse

from wearsim.errors import ScenarioError
from wearsim.scenario import load_scenario, parse_override
from wearsim.scenario.parse.mistakes import Mistakes

LOAD = '[load]\nnormal_force = "300 N"\n'
SLIP = "longitudinal = 1e-3"

MISTAKES = {
    "a number without unit, a wrong dimension and unknown keys": (
        '[roller]\nradius = "20 mm"',
        '[roller]\nradius = 20\ndiameter = "20 MPa"\nradus = "2 mm"\nspeed = "3 rpm"\nfoo = 1',
        """\
rig.toml: [roller] radius or diameter: exactly one is needed, got radius and diameter
rig.toml: [roller] radius: needs a unit, got 20, expected a length above zero such as "20 mm"
rig.toml: [roller] diameter: wrong dimension, got "20 MPa" (a pressure), expected a length above zero such as "20 mm"
rig.toml: [roller] radus: unknown key (did you mean 'radius'?)
rig.toml: [roller] speed: unknown key (it belongs in [operation])
rig.toml: [roller] foo: unknown key (known here: axial_profile, chamfer, chamfer_angle, crown_diameter, crown_radius, diameter, edge_radius, inertia, material, offset, profile, radius, width)""",
    ),
    "no radius": (
        'radius = "20 mm"\ncrown_radius = "500 mm"\n',
        "",
        """\
rig.toml: [roller] radius or diameter: exactly one is needed, got none
rig.toml: [roller] crown_radius or crown_diameter or axial_profile: exactly one is needed, got none""",
    ),
    "an unknown material": (
        '   # not the diameter\nmaterial = "steel"',
        '\nmaterial = "stel"',
        (
            'rig.toml: [cylinder] material: unknown material, got "stel", expected one of "steel",'
            ' "aluminium", "bronze", "ductile-iron" or a table of its constants'
        ),
    ),
    "a material's constants": (
        '   # not the diameter\nmaterial = "steel"',
        "\n[cylinder.material]\nyoungs_modulus = 3\npoison_ratio = 0.3\npoisson_ratio = 0.6",
        """\
rig.toml: [cylinder.material] youngs_modulus: needs a unit, got 3, expected a pressure above zero such as "200 GPa"
rig.toml: [cylinder.material] poisson_ratio: is out of range, got 0.6, expected a number of at least 0 and at most 0.5
rig.toml: [cylinder.material] poison_ratio: unknown key (did you mean 'poisson_ratio'?)""",
    ),
    "a missing key": (
        "coefficient = 0.1",
        "",
        "rig.toml: [friction] coefficient: is missing, expected a number above 0",
    ),
    "text for a number": (
        "coefficient = 0.1",
        'coefficient = "0.1"',
        (
            'rig.toml: [friction] coefficient: needs a number without quotes, got "0.1",'
            " expected a number above 0"
        ),
    ),
    "a percentage for a number": (
        "coefficient = 0.1",
        'coefficient = "10 %"',
        (
            'rig.toml: [friction] coefficient: needs a number without quotes and %, got "10 %",'
            " expected a number above 0"
        ),
    ),
    "an angle of chamfers without chamfer": (
        'radius = "20 mm"',
        'radius = "20 mm"\nchamfer_angle = "30 deg"',
        "rig.toml: [roller] chamfer_angle: has no meaning without chamfer",
    ),
    "a number that is not finite": (
        "coefficient = 0.1",
        "coefficient = nan",
        "rig.toml: [friction] coefficient: must be finite, got nan, expected a number above 0",
    ),
    "a fraction of a roller": (
        "rollers = 3",
        "rollers = 2.5",
        (
            "rig.toml: [operation] rollers: is not a whole number, got 2.5,"
            " expected a whole number of at least 1"
        ),
    ),
    "no roller": (
        "rollers = 3",
        "rollers = 0",
        (
            "rig.toml: [operation] rollers: is out of range, got 0,"
            " expected a whole number of at least 1"
        ),
    ),
    "hertz": (
        '"1000 rpm"',
        '"16 Hz"',
        (
            "rig.toml: [operation] speed: unknown unit 'Hz' (turns or radians? write rpm, turn/s or"
            ' rad/s), got "16 Hz", expected a rotation speed above zero such as "1000 rpm"'
        ),
    ),
    "duration and passes": (
        'duration = "450 min"',
        'duration = 07:30:00\npasses = "many"',
        """\
rig.toml: [operation] duration or passes or turns: exactly one is needed, got duration and passes
rig.toml: [operation] duration: ':30:00' is not a unit, got "07:30:00", expected a time above zero such as "450 min"
rig.toml: [operation] passes: is not a whole number, got "many", expected a whole number above 0""",
    ),
    "a misspelt table": (
        "[friction]",
        "[fricton]",
        """\
rig.toml: [fricton]: unknown table (did you mean 'friction'?)
rig.toml: [friction]: the table is missing""",
    ),
    "a value instead of a table and a table instead of a value": (
        'title = "a rig"\nseed = 3\n\n[roller]',
        'seed = -1\nspeed = "3 rpm"\nevolution = "implicit"\n[title]\n[roller]',
        """\
rig.toml: speed: unknown key (it belongs in [operation])
rig.toml: title: is not text, got a table, expected text
rig.toml: seed: is out of range, got -1, expected a whole number of at least 0 and at most 9223372036854775807
rig.toml: evolution: is not a table, got "implicit", expected a line [evolution] and its keys below""",
    ),
    "an unknown load and an incomplete term": (
        LOAD,
        '[load]\nkind = "sprin"\n[load.thermal]\ngain = "3 N"\n',
        """\
rig.toml: [load] kind: no load is named 'sprin'; known: constant, recorded, spring, thermal; did you mean 'spring'?
rig.toml: [load.thermal] gain: wrong dimension, got "3 N" (a force), expected a force per power such as "20 N/W"
rig.toml: [load.thermal] time_constant: is missing, expected a time such as "450 min\"""",
    ),
    "terms and loads mixed up": (
        LOAD,
        '[load]\nkind = "spring"\nstiffness = "3 N"\nthermal = 3\n[load.spring]\n[load.thrmal]\n',
        """\
rig.toml: [load.spring]: 'spring' is a load, chosen by load.kind, not a term
rig.toml: [load.thrmal]: no load is named 'thrmal'; known: constant, recorded, spring, thermal; did you mean 'thermal'?
rig.toml: [load] thermal: is a term of the load, got 3, expected a table [load.thermal]
rig.toml: [load] normal_force: is missing, expected a force above zero such as "300 N"
rig.toml: [load] stiffness: wrong dimension, got "3 N" (a force), expected a stiffness above zero such as "690 N/mm\"""",
    ),
    "a term chosen as the load": (
        "[load]",
        '[load]\nkind = "thermal"',
        "rig.toml: [load] kind: 'thermal' is a term, added by a table [load.thermal]",
    ),
    "an option of another load": (
        LOAD,
        LOAD + 'stiffness = "3 N/m"\n',
        'rig.toml: [load] stiffness: unknown key (it belongs in [load] with kind = "spring")',
    ),
    "a missing file of a load": (
        LOAD,
        '[load]\nkind = "recorded"\nfile = "gone.csv"\n',
        'rig.toml: [load] file: the file cannot be read, got "gone.csv"',
    ),
    "a load's file with mistakes": (
        LOAD,
        '[load]\nkind = "recorded"\nfile = "log.csv"\n',
        """\
rig.toml: [load] file: log.csv line 1: column 'load': wrong dimension, got m (a length), expected a unit of force such as N
rig.toml: [load] file: log.csv line 3: column 'load': is not a number, got 'x', expected a number""",
    ),
    "a profile with mistakes": (
        'radius = "25 mm"',
        'radius = "25 mm"\nprofile = "log.csv"',
        """\
rig.toml: [cylinder] profile: log.csv line 1: column 'y' is missing, got time [min], load [m], expected y [mm]
rig.toml: [cylinder] profile: log.csv line 1: column 'height' is missing, got time [min], load [m], expected height [mm] or z [mm] or depth [mm]; choose other names with --columns Y,Z or, in a scenario, profile_columns = ["Y", "Z"] or, in a tests file, columns; a minus sign before Z makes it a depth""",
    ),
    "creepage and bearing torque mixed up": (
        SLIP,
        f'drive = "free"\n{SLIP}\nyaw = ["1 mrad", "2 mrad", 3]\ntilt = ["0 mrad"]',
        """\
rig.toml: [creepage] bearing_torque: is needed with drive = "free", got none
rig.toml: [creepage] longitudinal: has no meaning with drive = "free"
rig.toml: [creepage] yaw (entry 3): needs a unit, got 3, expected an angle such as "1 mrad"
rig.toml: [creepage] tilt: a list has one value per roller, got 1 value, expected 3, the value of operation.rollers""",
    ),
    "a prescribed creepage that is missing": (
        SLIP,
        'bearing_torque = "-1 Nm"\ndifferential_slip = 1',
        """\
rig.toml: [creepage] longitudinal: is needed with drive = "creepage", got none
rig.toml: [creepage] bearing_torque: has no meaning with drive = "creepage"
rig.toml: [creepage] bearing_torque: must not be negative, got "-1 Nm", expected a torque of zero or more such as "0.5 N mm"
rig.toml: [creepage] differential_slip: is not true or false, got 1, expected true or false""",
    ),
    "an unknown drive": (
        SLIP,
        f'drive = "fre"\n{SLIP}',
        (
            "rig.toml: [creepage] drive: unknown choice (did you mean 'free'?), got \"fre\","
            ' expected one of "creepage", "free"'
        ),
    ),
    "an unknown contact model": (
        'model = "slender"',
        'model = "slendr"\nstrips = 2',
        """\
rig.toml: [contact] strips: is out of range, got 2, expected a whole number of at least 3
rig.toml: [contact] model: no contact model is named 'slendr'; known: hertz-fastsim, slender; did you mean 'slender'?""",
    ),
    "a contact model's options": (
        'model = "slender"',
        'model = "hertz-fastsim"\nmx = "3"\nmz = 4\nwidth = "0 mm"\nmodle = 1',
        """\
rig.toml: [contact] width: must be above zero, got "0 mm", expected a length above zero such as "20 mm"
rig.toml: [contact] mx: needs a number without quotes, got "3", expected a whole number of at least 2
rig.toml: [contact] mz: unknown key (known here: centre, model, mx, my, strips, width)
rig.toml: [contact] modle: unknown key (did you mean 'model'?)""",
    ),
    "an option of another contact model": (
        'model = "slender"',
        'model = "slender"\nmx = 4',
        (
            "rig.toml: [contact] mx: unknown key"
            ' (it belongs in [contact] with model = "hertz-fastsim")'
        ),
    ),
    "a wear law's options": (
        'cylinder = { k_over_h = "1.1e-11 1/Pa" }',
        'cylinder = { k_over_h = "1.1e-11 Pa", k_ov = 3 }',
        """\
rig.toml: [wear.cylinder] k_over_h: wrong dimension, got "1.1e-11 Pa" (a pressure), expected a wear factor of zero or more such as "1.1e-11 1/Pa"
rig.toml: [wear.cylinder] k_ov: unknown key (did you mean 'k_over_h'?)""",
    ),
    "a number where a wear law has a table": (
        'cylinder = { k_over_h = "1.1e-11 1/Pa" }',
        "cylinder = 3",
        "rig.toml: [wear] cylinder: is not a table, got 3, expected a table",
    ),
    "an unknown wear law": (
        'law = "archard-dissipation"',
        'law = "archard"',
        "rig.toml: [wear] law: no wear law is named 'archard'; known: archard-dissipation",
    ),
    "evolution and outputs": (
        "[wear]",
        (
            '[outputs]\nrecords = 20\nevery = "3 min"\nspacing = "lin"\n'
            '[evolution]\nstepper = "implict"\ntolerance = 0.5\nstep = 0\n[wear]'
        ),
        """\
rig.toml: [evolution] stepper: unknown choice (did you mean 'implicit'?), got "implict", expected one of "auto", "implicit", "stabilised", "explicit", "per-pass"
rig.toml: [evolution] tolerance: is out of range, got 0.5, expected a number of at least 1e-07 and at most 0.1
rig.toml: [evolution] step: is out of range, got 0, expected a whole number above 0
rig.toml: [outputs] records or every_passes or every: exactly one is needed, got records and every
rig.toml: [outputs] spacing: unknown choice, got "lin", expected one of "even", "log\"""",
    ),
    "a spacing without records": (
        "[wear]",
        '[outputs]\nevery = "3 min"\nspacing = "log"\n[wear]',
        "rig.toml: [outputs] spacing: goes with records, not with every",
    ),
    "a unit without quotes": (
        'radius = "20 mm"',
        "radius = 20 mm   # rolling",
        (
            "rig.toml: line 5, column 13: is not valid TOML: expected newline or end of document after"
            " a statement, got radius = 20 mm   # rolling, expected quotes around a value with a unit,"
            ' radius = "20 mm"'
        ),
    ),
    "a text without its end": (
        'radius = "20 mm"',
        'radius = "20 mm',
        (
            "rig.toml: line 5, column 16: is not valid TOML: illegal character '\\n',"
            ' got radius = "20 mm, expected a quotation mark at the end of the text'
        ),
    ),
    "a key given twice": (
        'radius = "20 mm"',
        'radius = "20 mm"\nradius = "2 mm"',
        (
            "rig.toml: line 6, column 16: is not valid TOML: cannot overwrite a value,"
            ' got radius = "2 mm", expected each key and table once in the file'
        ),
    ),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistake_is_reported_in_full(parse: Parse, case: str) -> None:
    good, bad, message = MISTAKES[case]
    files = {"log.csv": "time [min];load [m]\n0;1\n1;x\n"}
    with pytest.raises(ScenarioError) as caught:
        parse((good, bad), files=files)
    assert str(caught.value) == message


def test_mistakes_of_all_tables_are_reported_together(parse: Parse) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(
            ('radius = "20 mm"', "radius = 20"),
            ("coefficient = 0.1", "coefficient = 0"),
            ('"1000 rpm"', '"1000 mm"'),
            ('"1.1e-11 1/Pa"', '"-1 1/Pa"'),
        )
    places = [(mistake.table, mistake.key) for mistake in caught.value.mistakes]
    assert places == [
        ("roller", "radius"),
        ("operation", "speed"),
        ("friction", "coefficient"),
        ("wear.cylinder", "k_over_h"),
    ]


def test_empty_scenario_lacks_the_required_tables(parse: Parse) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(text="")
    assert str(caught.value).splitlines() == [
        f"rig.toml: [{table}]: the table is missing"
        for table in ("cylinder", "roller", "operation", "load", "friction", "creepage")
    ]


def test_too_long_integer_is_a_mistake(parse: Parse) -> None:
    with pytest.raises(ScenarioError, match="is not valid TOML"):
        parse(("seed = 3", f"seed = {'9' * 5000}"))


def test_unreadable_scenario_file_is_a_mistake(tmp_path: Path) -> None:
    missing, binary = tmp_path / "gone.toml", tmp_path / "binary.toml"
    with pytest.raises(ScenarioError) as caught:
        load_scenario(missing)
    assert str(caught.value) == (f"{missing}: the file cannot be read (No such file or directory)")
    binary.write_bytes(b"\xff\xfe")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(binary)
    assert str(caught.value) == f"{binary}: is not text in UTF-8"
    binary.write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(ScenarioError, match="results file, not a scenario; open it") as caught:
        load_scenario(binary)
    assert "not a scenario; show it with: wearsim show" in caught.value.at_shell


def test_deep_nesting_is_a_mistake_of_the_file(parse: Parse) -> None:
    with pytest.raises(ScenarioError, match=r"is nested too deeply"):
        parse(("seed = 3", "seed = " + "[" * 5000))


@pytest.mark.parametrize("levels", [25, 150, 300, 900, 5000])
@pytest.mark.parametrize("marks", ["[]", ("{a=", "}")])
def test_nesting_of_any_depth_is_one_mistake(parse: Parse, levels: int, marks: str) -> None:
    nested = marks[0] * levels + "1" + marks[1] * levels
    with pytest.raises(ScenarioError) as caught:
        parse(("coefficient = 0.1", f"coefficient = {nested}"))
    (mistake,) = caught.value.mistakes
    assert mistake.what == "is nested too deeply"
    assert mistake.expected == "at most 20 levels of tables and lists"
    for override in ({"friction.coefficient": nested}, {".".join("a" * levels): 1}):
        with pytest.raises(ScenarioError):
            parse(overrides=override)
    deep: list[object] = []
    deep.append(deep)
    with pytest.raises(ScenarioError, match="seed: is nested too deeply"):
        parse(overrides={"seed": deep})


def test_deep_setting_is_a_mistake_of_its_value() -> None:
    key, value = parse_override("friction.coefficient=" + "[" * 5000)
    assert (key, value) == ("friction.coefficient", "[" * 5000)


@pytest.mark.parametrize("text", ["0,1", "-12,5"])
def test_decimal_comma_of_a_setting_is_named(parse: Parse, text: str) -> None:
    key, value = parse_override(f"friction.coefficient={text}")
    with pytest.raises(ScenarioError, match="coefficient: needs a decimal point, got"):
        parse(overrides={key: value})


def test_decimal_comma_of_a_plain_number_gets_the_right_remedy(parse: Parse) -> None:
    with pytest.raises(ScenarioError, match=r"expected a decimal point, coefficient = 0\.1"):
        parse(("coefficient = 0.1", "coefficient = 0,1"))


def test_files_are_read_from_the_folder_of_the_scenario(
    small_registry: object, tmp_path: Path
) -> None:
    named = '[load]\nkind = "recorded"\nfile = "log.csv"\n'
    (tmp_path / "rig.toml").write_text(GOOD.replace(LOAD, named), encoding="utf-8")
    (tmp_path / "log.csv").write_text("time [s],load [N]\n0,1\n1,2\n", encoding="utf-8")
    scenario = load_scenario(tmp_path / "rig.toml")
    assert scenario.files == {"log.csv": "time [s],load [N]\n0,1\n1,2\n"}


def test_expected_multiple_is_reported():
    with pytest.raises(ScenarioError, match="expected a multiple of 4 of at least 4"):
        load_scenario(RIG, {"evolution.nodes": 6})


def test_keys_of_other_tables_are_suggested_only_if_much_alike() -> None:
    collector = Mistakes("rig.toml", str, lambda: {"[other]": ["over", "hardness"]})
    assert collector.hint("k_over_h", ["mild"]) == " (known here: mild)"
    assert collector.hint("hardnes", ["mild"]) == " (did you mean 'hardness' of [other]?)"
