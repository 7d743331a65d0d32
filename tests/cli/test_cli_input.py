"""The verbs check, contact, schema and plugins."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_examples import SCENARIOS, SHORT, Command

import wearsim
import wearsim.plugins
from wearsim.mechanics.hertz.ellipse import HertzContact
from wearsim.plugins.manager import Broken, Registry
from wearsim.studies.run.setup import Setup

# of strip theory, relative, and round-off
_OF_THEORY = {"mean-contact": 1e-12, "rig-450min": 1e-4}


def test_check_prints_what_will_run(command: Command, scenario: Path) -> None:
    result = command("check", scenario)
    assert result.exit_code == 0
    assert result.stdout.startswith("ok: a short [test]")
    assert "6,000 roller passes" in result.stdout
    assert "implicit" in result.stdout


def test_check_takes_settings(command: Command, scenario: Path) -> None:
    result = command("check", scenario, "--set", "operation.passes=900", "--set", "seed=3")
    assert "900 roller passes" in result.stdout


def test_check_prints_all_mistakes(command: Command, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(SHORT.replace('"20 mm"', "20").replace("normal_force", "normal_forse"))
    result = command("check", bad)
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert all(line.startswith(f"{bad}: [") for line in lines)
    assert any("[roller] radius: needs a unit, got 20, expected" in line for line in lines)
    assert any("normal_forse: unknown key (did you mean 'normal_force'?)" in line for line in lines)


@pytest.mark.parametrize("verb", ["check", "contact", "run", "show", "cam"])
def test_json_of_an_error_is_no_output(command: Command, tmp_path: Path, verb: str) -> None:
    result = command(verb, tmp_path / "missing.toml", "--json")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "missing.toml" in result.stderr


def test_check_prints_the_notes(command: Command, scenario: Path) -> None:
    stiff = 'roller.material={youngs_modulus = "800 GPa", poisson_ratio = 0.2}'
    result = command("check", scenario, "--set", stiff)
    assert result.exit_code == 0
    assert "note: the materials' Dundurs constant" in result.stderr


def test_check_describes_random_inputs(command: Command, scenario: Path) -> None:
    load = 'load.normal_force={distribution = "maxent", support = ["0 N", "inf"], mean = "307 N"'
    slack = 'creepage.misalignment={distribution = "disc", radius = "2 mrad"'
    result = command(
        *("check", scenario, "--set", load + ', std = "32 N"}', "--set", 'sampling.plan="sobol"'),
        *("--set", slack + ', persistence = "per-roller"}', "--set", "load.normal_force.std=30 N"),
    )
    rows = " ".join(result.stdout.split())
    assert "random load.normal_force maxent, mean 307 N, std 30 N, on [0, inf), per-test" in rows
    assert "per-test; 90 % range 257." in rows
    assert "load constant, 3" not in rows
    assert "creepage longitudinal 0.001 random" in rows
    assert "random creepage.misalignment disc, yaw up to 2 mrad, tilt up to 2 mrad" in rows
    assert "sampling sobol, realisation 0" in rows


def test_check_shows_profile_and_log(command: Command, scenario: Path) -> None:
    Path("worn.csv").write_text("y/mm;depth (um)\n6;0\n2;1,5\n-2;20,5\n-6;0\n")
    rows = [f"{10 * k},{(0 if k < 3 else 300) + k}\n" for k in range(10) if k != 4]
    Path("log.csv").write_text("time [s],load [N]\n0,0\n5,0\n" + "".join(rows[1:]) + "300,250\n")
    settings = [
        *("--set", "cylinder.profile='worn.csv'", "--set", "cylinder.profile_filter='9 mm'"),
        *("--set", 'load={kind="recorded", file="log.csv", gaps="hold"}'),
    ]
    result = command("check", scenario, *settings)
    assert result.exit_code == 0, result.stderr
    text = " ".join(result.stdout.split())
    assert "profile worn.csv: 4 points, y -6 to 6 mm, height -" in text
    assert "um (worn is negative; read from the column depth), filtered with 9 mm" in text
    assert "log log.csv: 0 to 5 min, 0 to 309 N, mean 2" in text
    assert "1 gap of 3.5 min, 1 pause of 0.08333 min" in text
    assert (
        "warning: log.csv: has a gap from 1.5 to 5 min; the last value is held"
        ' (load.gaps = "hold")' in result.stderr
    )
    data = json.loads(command("check", scenario, *settings, "--json").stdout)
    assert data["profile"]["y_m"] == [-0.006, 0.006]
    assert data["profile"]["column"] == "depth"
    assert data["log"]["gaps_s"] == [[90.0, 300.0]]
    assert data["log"]["pauses_s"] == [[0.0, 5.0]]
    assert data["log"]["span_s"] == [0.0, 300.0]
    assert data["test"]["passes"] == 6000
    assert data["warnings"][0].startswith("log.csv: has a gap")
    shorter = command("check", scenario, *settings, "--set", "operation.duration=89 s")
    assert shorter.exit_code == 0
    assert "has a gap" not in shorter.stderr


def test_check_shows_offsets_of_rollers(command: Command) -> None:
    result = command("check", SCENARIOS / "rig-three-rollers.toml")
    rows = " ".join(result.stdout.split())
    assert "crown radius 500 mm, offset -1 / 0.3 / 1 mm cylinder" in rows


def test_check_writes_random_inputs_as_json(command: Command, scenario: Path) -> None:
    friction = 'friction.coefficient={distribution="uniform", low=0.1, high=0.2}'
    data = json.loads(command("check", scenario, "--set", friction, "--json").stdout)
    assert "friction" not in data
    (item,) = data["random"]
    assert item["name"] == "friction.coefficient"
    (value,) = item["values"]
    assert value["mean"] == pytest.approx(0.15)
    assert value["range_90"] == pytest.approx([0.105, 0.195])


SOFT = '{youngs_modulus="200 GPa", poisson_ratio=0.3, yield_stress="100 MPa"}'


@pytest.mark.parametrize(
    ("setting", "warning"),
    [
        (f"roller.material={SOFT}", "roller.material: the peak pressure of 680.2 MPa at 300 N"),
        (
            f"cylinder.material={SOFT}".replace("yield_stress", "hardness"),
            "exceeds its hardness of 100 MPa",
        ),
        ("load.normal_force='300 kN'", "load: the peak pressure of 6802 MPa"),
        ("creepage.longitudinal=0.06", "creepage.longitudinal: a creepage of 0.06 exceeds 5%"),
        ("creepage.yaw='4 deg'", "creepage.yaw: a creepage of 0.0698 exceeds 5%"),
        (
            'friction.coefficient={distribution="uniform", low=0.5, high=1.2}',
            "friction.coefficient: 1.17 exceeds 1",
        ),
        ("roller.crown_radius='1e9 mm'", "and nothing ends it; set roller.width"),
        ("roller.crown_radius='10 mm'", "0.5767 x 0.5375 mm along and across rolling, is longer"),
    ],
)
def test_check_warns_of_implausible_inputs(
    command: Command, scenario: Path, setting: str, warning: str
) -> None:
    assert "warning" not in command("check", scenario).stderr
    result = command("check", scenario, "--set", setting)
    assert result.exit_code == 0, result.stderr
    assert "warning: " in result.stderr
    assert warning in result.stderr


def test_run_and_ensemble_keep_warnings_of_implausible_inputs(
    command: Command, scenario: Path
) -> None:
    creepage = ("--set", "creepage.longitudinal=0.06", "--set", "operation.passes=60")
    result = command("run", scenario, *creepage, "-o", "one.h5")
    assert "creepage.longitudinal: a creepage of 0.06 exceeds 5%" in result.stderr
    assert "0.06 exceeds 5%" in command("show", "one.h5").stderr
    friction = ("--set", 'friction.coefficient={distribution="uniform", low=0.1, high=0.2}')
    options = ("-n", 3, "-o", "many.h5", "--scheduler", "serial")
    result = command("ensemble", scenario, *creepage, *friction, *options)
    assert result.exit_code == 0, result.stderr
    assert "0.06 exceeds 5%" in result.stderr


def test_setting_without_a_value_is_bad_input(command: Command, scenario: Path) -> None:
    result = command("check", scenario, "--set", "seed")
    assert result.exit_code == 2
    assert "'seed' is not an override" in result.stderr


def _write_groove(name: str, half: float, roughness: float = 0.0) -> None:
    """Write a groove that fits the roller, measured from -half to half [mm]."""
    y = np.linspace(-half, half, 1601)
    height = -np.maximum(0.0, 48.0 - y**2) + roughness * np.random.default_rng(1).normal(size=1601)
    rows = "".join(f"{a:.5f},{b:.5f}\n" for a, b in zip(y, height, strict=True))
    Path(name).write_text(f"y [mm],height [um]\n{rows}")


def test_contact_is_wider_than_a_measured_conformal_groove(
    command: Command, scenario: Path
) -> None:
    for name, half in (("narrow.csv", 6.5), ("wide.csv", 12.0)):
        _write_groove(name, half)
    narrow, wide = (
        command("contact", scenario, "--profile", name) for name in ("narrow.csv", "wide.csv")
    )
    assert narrow.exit_code == wide.exit_code == 0, narrow.stderr
    assert "the contact is wider than the profile: the strips span -9." in narrow.stderr
    assert "wider" not in wide.stderr
    tilt = 'creepage.tilt={distribution="uniform", low="-0.5 mrad", high="0.5 mrad"}'
    profile = ("--set", "cylinder.profile='narrow.csv'", "--set", tilt)
    many = command("dissipation", scenario, *profile, "-n", 8, "--json")
    assert many.exit_code == 0, many.stderr
    assert json.loads(many.stdout)["realisations"] == 8
    fixed = ("--set", "contact.width='12 mm'")
    assert command("contact", scenario, "--profile", "narrow.csv", *fixed).exit_code == 1


def test_contact_warns_where_peak_pressure_depends_on_strips(
    command: Command, scenario: Path
) -> None:
    assert "warning" not in command("contact", scenario).stderr
    _write_groove("rough.csv", 8.0, roughness=0.4)
    profile = ("contact", scenario, "--profile", "rough.csv", "--json")
    rough = json.loads(command(*profile).stdout)
    assert rough["warnings"][0].startswith("peak pressure: ")
    assert (rough["profile"]["file"], rough["profile"]["points"]) == ("rough.csv", 1601)
    assert 'profile_filter = "0.8 mm"' in rough["warnings"][0]
    assert rough["peak_pressure_error_Pa"] > 0.1 * rough["peak_pressure_Pa"]
    smooth = json.loads(command(*profile, "--filter", "0.8 mm").stdout)
    assert smooth["peak_pressure_Pa"] < 0.5 * rough["peak_pressure_Pa"]
    assert smooth["profile"]["filter_m"] == 0.8e-3
    own = ("--set", "cylinder.profile='rough.csv'", "--set", "cylinder.profile_filter='0.8 mm'")
    same = json.loads(command("contact", scenario, *own, "--json").stdout)
    assert same["peak_pressure_Pa"] == smooth["peak_pressure_Pa"]


def test_contact_states_profile_and_sign(command: Command, scenario: Path) -> None:
    Path("worn.csv").write_text("Position;Depth\n-3;0\n0;2,5\n3;0\n")
    options = ("--columns", "Position,Depth", "--units", "mm,um")
    result = command("contact", scenario, "--profile", "worn.csv", *options)
    rows = " ".join(result.stdout.split())
    assert "profile worn.csv: 3 points, y -3 to 3 mm, height -2.5 to 0 um" in rows
    assert "(worn is negative; read from the column depth)" in rows


def test_depths_under_another_name_take_a_minus_sign(command: Command, scenario: Path) -> None:
    Path("worn.csv").write_text("Ort [mm];Tiefe [um]\n3;0\n0;2,5\n-3;0\n", encoding="utf-16")
    profile = ("contact", scenario, "--profile", "worn.csv", "--columns")
    heights = command(*profile, "Ort,Tiefe")
    assert "height 0 to 2.5 um" in " ".join(heights.stdout.split())
    assert (
        "note: worn.csv: column 'Tiefe' rises 2.5 um above its ends, and worn material is negative;"
        " if it holds depths, choose the columns Ort and -Tiefe\n"
    ) in heights.stderr
    depths = command(*profile, "Ort,-Tiefe")
    assert "height -2.5 to 0 um" in " ".join(depths.stdout.split())
    assert "Tiefe" not in depths.stderr
    start = ("check", scenario, "--set", "cylinder.profile='worn.csv'", "--set")
    checked = command(*start, "cylinder.profile_columns=['Ort', '-Tiefe']")
    assert "height -2.5 to 0 um" in " ".join(checked.stdout.split())
    checked = command(*start, "cylinder.profile_columns=['Ort', 'Tiefe']")
    assert "note: worn.csv: column 'Tiefe' rises 2.5 um above its ends" in checked.stderr


def test_options_of_a_profile_need_one(command: Command, scenario: Path) -> None:
    for option in (("--filter", "0.8 mm"), ("--columns", "y,z"), ("--row", 2)):
        result = command("contact", scenario, *option)
        assert result.exit_code == 2
        assert "Invalid value for --profile: is needed for" in result.stderr
    _write_groove("groove.csv", 8.0)
    result = command("contact", scenario, "--profile", "groove.csv", "--filter", "0.8")
    assert result.exit_code == 2
    assert "Invalid value for --filter: needs a unit" in result.stderr


def hertz_patch(file: Path) -> HertzContact:
    """Return the exact ellipse of a scenario of 300 N."""
    return Setup(wearsim.load_scenario(file)).widest_patch(300.0)


def test_contact_prints_engineering_units(command: Command) -> None:
    result = command("contact", SCENARIOS / "mean-contact.toml")
    assert result.exit_code == 0
    rows = {line[:24].strip(): line[24:].strip() for line in result.stdout.splitlines()}
    length, _, length_error, _ = rows["patch length 2a"].split()
    patch = hertz_patch(SCENARIOS / "mean-contact.toml")
    assert float(length) == pytest.approx(2e3 * patch.a, abs=float(length_error))
    assert rows["peak pressure"] == "680.2 MPa"
    data = json.loads(command("contact", SCENARIOS / "mean-contact.toml", "--json").stdout)
    assert rows["dissipated power"] == f"0.07387 ± {data['power_error_W']:.1e} W"
    assert rows["spin moment"] == "0 N mm"
    width, _, width_error, unit = rows["patch width"].split()
    assert (float(width), unit) == (pytest.approx(2e3 * patch.b, abs=float(width_error)), "mm")
    assert float(width_error) < 0.02 * float(width)


@pytest.mark.parametrize("strips", [15, 31, 50, 121])
@pytest.mark.parametrize("name", ["mean-contact", "rig-450min"])
def test_stated_errors_of_the_patch_hold_the_patch_of_hertz(
    name: str, strips: int, command: Command
) -> None:
    file = SCENARIOS / f"{name}.toml"
    key = "contact.my" if name == "mean-contact" else "contact.strips"
    data = json.loads(command("contact", file, "--set", f"{key}={strips}", "--json").stdout)
    patch = hertz_patch(file)
    for side, exact in (("length", 2.0 * patch.a), ("width", 2.0 * patch.b)):
        error = data[f"patch_{side}_error_m"]
        assert abs(data[f"patch_{side}_m"] - exact) <= error + _OF_THEORY[name] * exact
        assert error < 0.1 * exact


def test_contact_json_is_si_and_all_of_stdout(command: Command) -> None:
    result = command("contact", SCENARIOS / "mean-contact.toml", "--json")
    assert result.stderr == ""
    data = json.loads(result.stdout)
    assert data["power_W"] == pytest.approx(0.073873, rel=1e-3)
    assert data["patch_length_m"] == pytest.approx(0.2726e-3, rel=1e-3)
    strips = data["strips"]
    spacing = strips["y_m"][1] - strips["y_m"][0]
    assert sum(strips["line_load_N_per_m"]) * spacing == pytest.approx(300.0)


def test_contact_takes_a_worn_profile(command: Command, tmp_path: Path) -> None:
    groove = tmp_path / "groove.csv"
    rows = [f"{y},{min(0.0, y * y - 16.0)}" for y in range(-8, 9)]
    groove.write_text("y [mm], height [um]\n" + "\n".join(rows))
    path = SCENARIOS / "rig-450min.toml"
    worn = json.loads(command("contact", path, "--profile", groove, "--json").stdout)
    fresh = json.loads(command("contact", path, "--json").stdout)
    assert worn["peak_pressure_Pa"] < 0.99 * fresh["peak_pressure_Pa"]


@pytest.mark.parametrize("text", [None, "y [mm], hight [um]\n0,1\n1,1\n"])
def test_bad_profile_is_bad_input(command: Command, tmp_path: Path, text: str | None) -> None:
    groove = tmp_path / "groove.csv"
    if text is not None:
        groove.write_text(text)
    result = command("contact", SCENARIOS / "mean-contact.toml", "--profile", groove)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"{groove}: ")


def test_contact_draws_a_figure_and_keeps_an_existing_one(command: Command, tmp_path: Path) -> None:
    figure = tmp_path / "contact.png"
    arguments = ("contact", SCENARIOS / "mean-contact.toml", "-o", figure)
    assert command(*arguments).exit_code == 0
    assert figure.read_bytes().startswith(b"\x89PNG")
    figure.write_text("mine")
    refused = command(*arguments)
    assert (refused.exit_code, figure.read_text()) == (2, "mine")
    assert "--force" in refused.stderr
    assert command(*arguments, "--force").exit_code == 0
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_unknown_figure_format_is_bad_input(command: Command) -> None:
    result = command("contact", SCENARIOS / "mean-contact.toml", "-o", "contact.jpeg2")
    assert result.exit_code == 2
    assert ".png, .pdf or .svg" in result.stderr


def test_figure_in_a_missing_folder_is_bad_input(command: Command) -> None:
    result = command("contact", SCENARIOS / "mean-contact.toml", "-o", "nowhere/contact.png")
    assert result.exit_code == 2
    assert "folder nowhere does not exist" in result.stderr


def test_schema_is_json_with_every_table(command: Command) -> None:
    result = command("schema")
    assert result.exit_code == 0
    assert {"roller", "cylinder", "operation"} <= json.loads(result.stdout)["properties"].keys()


def test_plugins_lists_one_line_per_plugin(command: Command) -> None:
    result = command("plugins")
    assert result.exit_code == 0
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("slender")]
    assert "contact model wearsim" in " ".join(line.split())
    assert "wear compliance" in line


def test_plugins_reports_broken_plugins(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    registry = Registry([])
    registry.broken.append(Broken("winkler", "wearsim-winkler", "1.2", "ImportError: no torch"))
    monkeypatch.setattr(wearsim.plugins, "registry", lambda: registry)
    message = "plugin 'winkler' of wearsim-winkler 1.2 failed to load: ImportError: no torch"
    assert message in command("plugins").stderr
    listed = json.loads(command("plugins", "--json").stdout)
    assert listed["plugins"] == []
    assert listed["broken"][0]["cause"] == "ImportError: no torch"


def test_plugins_json_has_distribution_and_capabilities(command: Command) -> None:
    listed = json.loads(command("plugins", "--json").stdout)["plugins"]
    (slender,) = [item for item in listed if item["name"] == "slender"]
    assert (slender["kind"], slender["distribution"]) == ("contact model", "wearsim")
    assert "wear_compliance" in slender["capabilities"]


def test_figure_of_a_model_without_fields(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from wearsim.plugins import ContactModelSpec, registry

    item = registry().registered(ContactModelSpec, "hertz-fastsim")
    bare = replace(item.spec, capabilities=replace(item.spec.capabilities, fields=False))
    monkeypatch.setitem(
        registry()._specs[ContactModelSpec], "hertz-fastsim", replace(item, spec=bare)
    )
    result = command("contact", SCENARIOS / "mean-contact.toml", "-o", tmp_path / "c.svg")
    assert result.exit_code == 0
    assert "gives no fields" in result.stderr
    assert (tmp_path / "c.svg").read_text().count("<svg") == 1


def test_contact_notes_that_random_inputs_are_at_their_means(command: Command) -> None:
    paper = SCENARIOS / "paper-monte-carlo.toml"
    field = (
        'friction.coefficient={distribution="white", marginal={distribution="uniform", low=0.08,'
        " high=0.12}}"
    )
    lines = command("contact", paper, "--set", field).stderr.splitlines()
    assert (
        "note: random inputs are set to their means: creepage.longitudinal, creepage.misalignment,"
        " load.normal_force"
    ) in lines
    fields = "random fields are set to the means of their marginals: friction.coefficient"
    assert f"note: {fields}" in lines
    assert "means" not in command("contact", SCENARIOS / "mean-contact.toml").stderr


def test_figure_replaces_no_profile(command: Command) -> None:
    profile = Path("worn.png")
    profile.write_text("y [mm],height [um]\n-5,0\n0,-1\n5,0\n")
    arguments = ("contact", SCENARIOS / "mean-contact.toml", "--profile", profile)
    result = command(*arguments, "-o", profile, "--force")
    assert result.exit_code == 2
    assert "the profile is read from worn.png" in result.stderr
    assert profile.read_text().startswith("y [mm]")


def test_contact_is_compared_with_another_model(command: Command, scenario: Path) -> None:
    result = command("contact", scenario, "--against", "hertz", "-o", "both.png")
    assert result.exit_code == 0
    assert "difference from 'hertz'" in result.stdout
    assert "its own error" in result.stdout
    assert Path("both.png").stat().st_size > 10_000
    data = json.loads(command("contact", scenario, "--against", "hertz", "--json").stdout)
    assert 0.0 < data["against"]["errors"]["dissipation"] < 0.01
    assert len(data["against"]["strips"]["dissipation_W_per_m"]) == 121
    missing = command("contact", scenario, "--against", "none-such")
    assert missing.exit_code == 2
    assert "--against" in missing.stderr
    assert "no contact model 'none-such' is installed" in missing.stderr
