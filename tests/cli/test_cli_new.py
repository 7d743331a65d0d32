"""`wearsim new`: plugins from the template, and scenarios that run."""

from __future__ import annotations

import ast
import math
import re
import runpy
import shutil
import tomllib
from pathlib import Path

import pytest
from cli_examples import Command

from wearsim.plugins import template
from wearsim.scenario import parse_scenario
from wearsim.scenario.examples import starter_scenario
from wearsim.scenario.parse.toml import TABLES
from wearsim.studies.cam.turn import turn_of

ROOT = Path(__file__).parents[2]
PROFILE = "y [mm], height [um]\n" + "".join(
    f"{k / 5}, {abs(k) / 100 - 1}\n" for k in range(-100, 101)
)
FILES = {
    "profile.csv": PROFILE,
    **{f"map.sdf#{rows}": PROFILE for rows in ("row=3", "mean_rows=[0, 10]", 'at="2 mm"')},
    "log.csv": "time [min], load [N]\n0, 300\n450, 310\n",
    "force.csv": "angle [deg], force [N]\n0, 10\n90, 20\n180, 10\n270, 0\n",
    "lift.csv": "angle [deg], lift [mm]\n"
    + "".join(f"{a}, {math.cos(math.radians(a))}\n" for a in range(0, 360, 10)),
    "worn.csv": "angle [deg], y [mm], height [um]\n"
    + "".join(f"{a}, {y}, -1\n" for a in range(0, 360, 10) for y in (-10, 0, 10)),
    "cam.csv": "angle [deg], radius [mm]\n" + "".join(f"{a}, 25\n" for a in range(0, 360, 10)),
}


STARTERS = ("starter", "starter_cam")


def alternatives() -> list[tuple[str, str, str, str]]:
    """Return starter, table, line and remark of every alternative in the starter scenarios."""
    return [(name, *item) for name in STARTERS for item in alternatives_of(name)]


def alternatives_of(name: str) -> list[tuple[str, str, str]]:
    """Return table, lines and remark of every alternative in a starter scenario.

    Lines below a text that ends with a colon are one alternative, with the text as the remark.
    """
    found, table, head = [], "", ""
    for line in starter_scenario(name).splitlines():
        if line.startswith("["):
            table = line[1 : line.index("]")]
        parts = re.fullmatch(r"# (\w+ = [^#]*?)\s*(#.*)?", line)
        if parts and head == "joined":
            found[-1] = table, f"{found[-1][1]}\n{parts[1]}", found[-1][2]
        elif parts:
            found.append((table, parts[1], f"{head} {parts[2] or ''}".strip()))
            head = "joined" if head else ""
        else:
            head = line.lower() if line.startswith("# ") and line.endswith(":") else ""
    return found


def with_alternative(name: str, table: str, line: str, remark: str) -> str:
    """Return a starter scenario with one alternative applied according to its remark."""
    replaced = re.findall(r"instead of (\w+)", remark)
    companions = re.findall(r'with (\w+ = (?:"[^"]+"|[0-9.]*[0-9]))', remark)
    added = [*line.splitlines(), *companions]
    removed = {*replaced, *(item.split(" = ")[0] for item in added)}
    lines, here = [], ""
    multiline = re.sub(r"\[\n(.*?)\n\]", _on_one_line, starter_scenario(name), flags=re.DOTALL)
    for text in multiline.splitlines():
        if text.startswith("["):
            here = text[1 : text.index("]")]
            lines.append(text)
            lines += added if here == table else []
        elif here != table or text.split(" = ")[0] not in removed:
            lines.append(text)
    return "\n".join(lines)


def _on_one_line(found: re.Match[str]) -> str:
    return f"[{' '.join(found[1].split())}]"


def test_new_scenario_runs_unchanged(command: Command) -> None:
    written = command("new", "scenario")
    assert (written.exit_code, written.stdout) == (0, "scenario.toml\n")
    assert written.stderr == "next: wearsim run scenario.toml\n"
    done = command("run", "scenario.toml", "-q")
    assert done.exit_code == 0, done.output
    assert "finished: 1,350,000 passes" in done.stdout


def test_new_scenario_replaces_files_only_with_force(command: Command) -> None:
    Path("mine.toml").write_text("mine")
    refused = command("new", "scenario", "mine.toml")
    assert (refused.exit_code, Path("mine.toml").read_text()) == (2, "mine")
    assert "mine.toml exists" in refused.stderr
    assert command("new", "scenario", "mine.toml", "--force").exit_code == 0
    assert Path("mine.toml").read_text() == starter_scenario()


def test_folder_of_a_new_scenario_must_exist(command: Command) -> None:
    refused = command("new", "scenario", "no/where.toml")
    assert refused.exit_code == 2
    assert "folder no does not exist" in refused.stderr


@pytest.mark.parametrize("arguments", [["folder"], ["folder", "--force"]])
def test_folder_is_refused_as_a_scenario(command: Command, arguments: list[str]) -> None:
    Path("folder").mkdir()
    refused = command("new", "scenario", *arguments)
    assert refused.exit_code == 2
    message = " ".join(refused.stderr.split())
    assert "folder is a folder; name a file in it: folder/scenario.toml" in message
    assert not list(Path("folder").iterdir())


def test_unwritable_files_are_reported(command: Command) -> None:
    Path("file").write_text("mine")
    refused = command("new", "plugin", "sponge", "-d", "file")
    assert (refused.exit_code, Path("file").read_text()) == (2, "mine")
    assert "cannot write to file (Not a directory)" in " ".join(refused.stderr.split())
    name = 300 * "a"  # longer than a file's name may be
    for arguments in (["plugin", name], ["scenario", name, "--force"]):
        refused = command("new", *arguments)
        assert refused.exit_code == 2
        assert "choose another name or folder" in " ".join(refused.stderr.split())


def commented_fatigue() -> str:
    """Return the lines of [fatigue] that the starter scenario has in comments."""
    text = starter_scenario("starter")
    lines = text[text.index("# Rolling-contact fatigue") :].splitlines()
    return "\n".join(line[4:] for line in lines if line.startswith("#   "))


def test_commented_fatigue_of_the_starter_scenario_is_valid() -> None:
    text = f"{starter_scenario('starter')}\n{commented_fatigue()}\n"
    scenario = parse_scenario(text, "new.toml", FILES.__getitem__)
    assert scenario.fatigue is not None
    assert {*scenario.fatigue.laws} == {"cylinder", "roller"}


def test_starter_scenario_shows_every_key() -> None:
    sections: dict[str, str] = {}
    for name in STARTERS:
        parts = iter(re.split(r"^\[(\w+)\]", starter_scenario(name), flags=re.M)[1:])
        for table, text in zip(*[parts] * 2, strict=True):
            sections[table] = sections.get(table, "") + text
    # in comments, since its constants are those of a material
    sections["fatigue"] = commented_fatigue()
    assert set(sections) == set(TABLES)
    for table, model in TABLES.items():
        shown = set(re.findall(r"^(?:# )?(\w+)(?:\.\w+)? = ", sections[table], flags=re.M))
        if table in {"follower", "limit"}:  # those of a swinging arm and of fatigue are in words
            shown |= set(re.findall(r"\w+", sections[table]))
        assert set(model.model_fields) <= shown, table


@pytest.mark.parametrize(("name", "table", "line", "remark"), alternatives())
def test_every_alternative_of_the_starter_scenario_is_valid(
    name: str, table: str, line: str, remark: str
) -> None:
    text = with_alternative(name, table, line, remark)
    for key, value in tomllib.loads(line).items():
        assert tomllib.loads(text)[table][key] == value
    scenario = parse_scenario(text, "new.toml", FILES.__getitem__)
    if scenario.cam is not None:
        assert turn_of(scenario).stations.count > 0


def test_new_plugin_is_the_renamed_template(command: Command) -> None:
    done = command("new", "plugin", "soft-layer", "--directory", "plugins")
    assert done.exit_code == 0, done.output
    folder = Path("plugins/wearsim-soft-layer")
    written = {Path(line).relative_to(folder).as_posix() for line in done.stdout.splitlines()}
    assert written == {
        "README.md",
        "pyproject.toml",
        "src/wearsim_soft_layer/__init__.py",
        "src/wearsim_soft_layer/study.py",
        "tests/test_soft_layer.py",
    }
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert project["name"] == "wearsim-soft-layer"
    assert project["entry-points"]["wearsim"] == {"soft-layer": "wearsim_soft_layer"}
    for path in folder.rglob("*"):
        assert "winkler" not in path.name
        if path.is_file():
            text = path.read_text()
            assert not re.search("winkler|wearsim.template", text, flags=re.IGNORECASE), path
    module = ast.parse((folder / "src/wearsim_soft_layer/__init__.py").read_text())
    classes = [node.name for node in module.body if isinstance(node, ast.ClassDef)]
    forms = ["SoftLayerFormOptions", "SoftLayerForm"]
    assert classes == ["SoftLayerOptions", "SoftLayer", *forms, "ApproachTable"]
    compile((folder / "tests/test_soft_layer.py").read_text(), "test_soft_layer.py", "exec")
    assert "pip install -e" in done.stderr


@pytest.mark.parametrize(
    "name", ["Sponge", "soft_layer", "1st", "-a", "a--b", "a-", "", "wearsim-a", "é", "a b", "../a"]
)
def test_invalid_plugin_name_is_refused(command: Command, name: str) -> None:
    refused = command("new", "plugin", "--", name)
    assert refused.exit_code == 2
    assert "lower-case words" in " ".join(refused.stderr.split())
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    ("name", "taken"),
    [
        ("contact-solution", "ContactSolution"),
        ("annotated", "Annotated"),
        ("modulus", "Modulus"),
        ("s-p-e-c", "SPEC"),
        ("contact-models", "wearsim_contact_models"),
        ("none", "None"),
    ],
)
def test_plugin_name_used_in_its_code_is_refused(command: Command, name: str, taken: str) -> None:
    refused = command("new", "plugin", name)
    assert refused.exit_code == 2
    message = " ".join(refused.stderr.split())
    assert f"would define the name {taken}," in message
    assert f"add a word, 'my-{name}'" in message
    assert not list(Path().iterdir())
    assert command("new", "plugin", f"my-{name}").exit_code == 0


def test_name_of_an_installed_plugin_is_refused(command: Command) -> None:
    refused = command("new", "plugin", "slender")
    assert refused.exit_code == 2
    assert "a contact model named 'slender' is already installed" in refused.stderr


def test_new_plugin_replaces_no_folder(command: Command) -> None:
    Path("wearsim-sponge").mkdir()
    refused = command("new", "plugin", "sponge")
    assert refused.exit_code == 2
    assert "wearsim-sponge exists" in refused.stderr
    assert not list(Path("wearsim-sponge").iterdir())


def test_template_is_found_installed_or_in_a_clone(tmp_path: Path) -> None:
    assert template.template_folder() == ROOT / "plugins" / "wearsim-template"
    installed = tmp_path / "wearsim"
    (installed / "plugins").mkdir(parents=True)
    module = shutil.copy(str(template.__file__), installed / "plugins")
    (installed / "plugin_template").mkdir()
    found = runpy.run_path(str(module))["template_folder"]()
    assert found == installed / "plugin_template"


def test_wheel_contains_the_files_of_new() -> None:
    from hatchling.builders.wheel import WheelBuilder

    included = WheelBuilder(str(ROOT)).recurse_included_files()
    files = {item.distribution_path.replace("\\", "/") for item in included}
    assert "wearsim/scenario/starter.toml" in files
    folder = template.template_folder()
    for name in ("pyproject.toml", "README.md", "src/wearsim_template/__init__.py",
                 "tests/test_winkler.py"):  # fmt: skip
        assert (folder / name).is_file()
        assert f"wearsim/plugin_template/{name}" in files
    # first folder searched by an installed package
    assert template._FOLDERS[0].relative_to(ROOT).as_posix() == "wearsim/plugin_template"


def test_editable_install_has_no_copy_of_the_template(tmp_path: Path) -> None:
    import zipfile

    from hatchling.builders.wheel import WheelBuilder

    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["editable"])
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (path,) = (name for name in names if name.endswith(".pth"))
        assert archive.read(path).decode().strip() == str(ROOT)
    assert not [name for name in names if "template" in name]
