"""The verbs check, contact, schema and plugins."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, SHORT, Command

import wearsim.plugins
from wearsim.plugins.manager import Broken, Registry


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
    assert "random creepage.misalignment disc, yaw up to 2 mrad, tilt up to 2 mrad" in rows
    assert "sampling sobol, realisation 0" in rows


def test_setting_without_a_value_is_bad_input(command: Command, scenario: Path) -> None:
    result = command("check", scenario, "--set", "seed")
    assert result.exit_code == 2
    assert "'seed' is not an override" in result.stderr


def test_contact_prints_engineering_units(command: Command) -> None:
    result = command("contact", SCENARIOS / "mean-contact.toml")
    assert result.exit_code == 0
    rows = {line[:24].strip(): line[24:].strip() for line in result.stdout.splitlines()}
    assert rows["patch length 2a"] == "0.2726 mm"
    assert rows["peak pressure"] == "680.2 MPa"
    assert rows["dissipated power"] == "0.07387 W"
    assert rows["spin moment"] == "0 N mm"
    width, unit = rows["patch width"].split()
    assert (float(width), unit) == (pytest.approx(3.0898, rel=3e-3), "mm")


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
    assert "contact model  wearsim" in line
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
        "random inputs are set to their means: creepage.longitudinal, creepage.misalignment,"
        " load.normal_force"
    ) in lines
    assert "random fields are set to the means of their marginals: friction.coefficient" in lines
    assert "means" not in command("contact", SCENARIOS / "mean-contact.toml").stderr


def test_figure_replaces_no_profile(command: Command) -> None:
    profile = Path("worn.png")
    profile.write_text("y [mm],height [um]\n-5,0\n0,-1\n5,0\n")
    arguments = ("contact", SCENARIOS / "mean-contact.toml", "--profile", profile)
    result = command(*arguments, "-o", profile, "--force")
    assert result.exit_code == 2
    assert "the profile is read from worn.png" in result.stderr
    assert profile.read_text().startswith("y [mm]")
