"""Disk cache of compiled kernels: shared by processes, at a writable location."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from wearsim.mechanics.numerics import jit

ROOT = Path(__file__).parents[1]
SCENARIOS = ROOT / "scenarios"

CONTACT = f"""
import hashlib, json, sys
import wearsim
scenario = wearsim.load_scenario(r"{SCENARIOS / "rig-450min.toml"}", {{"contact.model": "hertz"}})
solution = wearsim.solve_contact(scenario)
from wearsim.mechanics.hertz.parabola_fit import hertz_on_profile as kernel
stats = kernel.dispatcher.stats
print(json.dumps({{
    "bits": hashlib.sha256(solution.dissipation.tobytes()).hexdigest(),
    "hits": sum(stats.cache_hits.values()),
    "misses": sum(stats.cache_misses.values()),
    "path": stats.cache_path,
    "file": wearsim.__file__,
}}))
"""

PATCH = """
import json
import wearsim
from wearsim.mechanics.hertz.ellipse import prescribed_ellipse as kernel
kernel(1e-3, 2e-3, 300.0, 1e11)
stats = kernel.dispatcher.stats
print(json.dumps({"hits": sum(stats.cache_hits.values()), "path": stats.cache_path,
    "file": wearsim.__file__}))
"""

EVERYTHING = f"""
import json
import numpy as np
import wearsim
from pathlib import Path
from numba.core import event
from wearsim.contact_batch import ContactBatch
from wearsim.mechanics.numerics import jit
from wearsim.models.contact.hertz_fastsim import HertzFastsim, HertzFastsimOptions
from wearsim.mechanics.numerics.gaussian_processes import squared_residuals
from wearsim.types import Creepage, Grid, Material, OperatingPoint

jit._call_elsewhere = lambda name, interpreted: None  # compile all of them in this process
compiled = event.RecordingListener()
event.register("numba:compile", compiled)

def scenario(name, **overrides):
    overrides = {{key.replace("__", "."): value for key, value in overrides.items()}}
    return wearsim.load_scenario(Path(r"{SCENARIOS}") / name, overrides)

def run(name="rig-450min.toml", **overrides):
    wearsim.run(scenario(name, operation__duration="1 min", **overrides))

for stepper in ("implicit", "explicit", "per-pass"):
    for name in ("rig-450min.toml", "rig-three-rollers.toml"):
        run(name, evolution__stepper=stepper)
run(load={{"kind": "spring", "normal_force": "300 N", "stiffness": "690 N/mm"}})
for name in ("rig-450min.toml", "rig-three-rollers.toml"):  # grooves, at whose edges strips are cut
    run(name, wear__cylinder__k_over_h="1e-8 1/Pa")
law = {{"law": "pressure-life", "reference_passes": 1e6, "reference_pressure": "1 GPa"}}
run(fatigue={{"slope": 1.1, "cylinder": law | {{"exponent": 8.0, "source": "none"}}}})
wearsim.run(scenario("cam-eccentric.toml", operation__turns=100))
run(contact__tangential="fastsim")
for model in ("hertz-fastsim", "hertz"):
    run(contact__model=model)
for variant in ("kik-piotrowski", "ayasse-chollet", "analyn"):
    run(contact__model="semi-hertzian", contact__variant=variant)
spin = {{"creepage__yaw": "0.5 mrad", "creepage__tilt": "1 mrad"}}
wearsim.study_contact(
    scenario("mean-contact.toml", contact={{"model": "hertz", "tangential": "fastrip"}}, **spin),
    with_fields=True,
)
run(creepage={{"drive": "free", "bearing_torque": "10 N mm"}})
marginal = {{"distribution": "uniform", "low": 0.09, "high": 0.11}}
process = {{"distribution": "ornstein-uhlenbeck", "correlation_time": "10 s", "marginal": marginal}}
run(friction__coefficient=process, creepage__misalignment={{
    "distribution": "disc", "radius": "1 mrad", "persistence": "per-pass"}})
field = {{"distribution": "gaussian-field", "correlation_length": "300 um", "marginal": marginal}}
wearsim.dissipation(scenario("mean-contact.toml", friction__coefficient=field), 2)
wearsim.study_contact(
    scenario("mean-contact.toml", contact={{"model": "hertz", "tangential": "fastsim"}}, **spin)
)
march = spin | {{"contact__closed_form": "never"}}
wearsim.study_contact(scenario("mean-contact.toml", **march))
steel, grid = Material(200e9, 0.3), Grid.spanning(-3e-3, 3e-3, 61)
model = HertzFastsim(HertzFastsimOptions(), grid, (steel, steel))
point = OperatingPoint(300.0, 2.6, Creepage(1e-3), 0.1)
model.friction_points(ContactBatch.of(grid.y[None] ** 2, 90.0, [point]))
one = np.ones((3, 2))
squared_residuals(np.ones((4, 3)), one, one, one, np.ones((1, 3, 2)))
counts = {{}}
for _, begun in compiled.buffer:
    function = begun.data["dispatcher"].py_func
    if begun.is_start and function.__module__.startswith("wearsim.mechanics."):
        name = function.__module__.split(".")[-1] + "." + function.__name__
        counts.setdefault(name, set()).add(str(begun.data["args"]))
counts = {{name: sorted(found) for name, found in counts.items()}}
print(json.dumps(counts))
"""


def start(code: str, environment: dict[str, str]) -> subprocess.Popen[str]:
    clean = {k: v for k, v in os.environ.items() if k not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code],
        env=clean | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process: subprocess.Popen[str]) -> Any:
    output, errors = process.communicate()
    assert process.returncode == 0, errors
    return json.loads(output)


def run(code: str, **environment: object) -> Any:
    return finish(start(code, {key: str(value) for key, value in environment.items()}))


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """Return the folder of a copy of the package without compiled kernels."""
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "wearsim", tmp_path / "site" / "wearsim", ignore=ignore)
    return tmp_path / "site"


def make_read_only(site: Path) -> None:
    """Replace the cache folder next to the kernels by a file, which also blocks root."""
    (site / "wearsim" / "mechanics" / "__pycache__").write_text("not a folder")


@pytest.mark.slow
def test_concurrent_processes_share_an_empty_cache(site: Path, tmp_path: Path):
    environment = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(site)}
    processes = [start(CONTACT, environment) for _ in range(4)]
    results = [finish(process) for process in processes]
    later = run(CONTACT, **environment)
    assert {item["bits"] for item in results} == {later["bits"]}
    assert later["hits"] == 1
    assert later["misses"] == 0
    assert Path(later["path"]).is_relative_to(tmp_path / "cache")


def kernels() -> set[str]:
    """Return module and name of all kernels and subroutines that are compiled separately."""
    head = re.compile(r"^@(?:kernel|subroutine|subroutine_of\(\w+\))\ndef (\w+)", re.MULTILINE)
    files = (ROOT / "wearsim" / "mechanics").rglob("*.py")
    return {f"{file.stem}.{name}" for file in files for name in head.findall(file.read_text())}


@pytest.mark.slow
def test_every_kernel_has_one_signature(tmp_path: Path):
    counts = run(EVERYTHING, NUMBA_CACHE_DIR=tmp_path)
    unused = kernels() - set(counts)
    assert not unused, f"not reached by this test's runs: {unused}"
    # with and without shared bodies, friction field and fields
    for name in ("solve_slender", "start_strips", "rest_contacts", "factor_contacts", "fill_steps"):
        assert len(counts.pop(f"newton.{name}")) == 2
    assert len(counts.pop("fastsim.march_into")) == 3
    several = {name: signatures for name, signatures in counts.items() if len(signatures) > 1}
    assert not several, json.dumps(several, indent=1)


def test_writable_install_has_its_cache_next_to_the_kernels(site: Path):
    first, second = (run(PATCH, PYTHONPATH=site) for _ in range(2))
    assert Path(first["file"]).is_relative_to(site)
    cache = site / "wearsim" / "mechanics" / "__pycache__"
    assert Path(first["path"]).is_relative_to(cache)
    assert (first["hits"], second["hits"]) == (0, 1)


def test_read_only_install_has_its_cache_in_the_user_folder(site: Path, tmp_path: Path):
    make_read_only(site)
    environment = {"PYTHONPATH": site, "XDG_CACHE_HOME": tmp_path / "cache"}
    first, second = (run(PATCH, **environment) for _ in range(2))
    assert Path(first["file"]).is_relative_to(site)
    assert Path(first["path"]).is_relative_to(tmp_path / "cache")
    assert (first["hits"], second["hits"]) == (0, 1)


SLENDER = f"""
import json
import wearsim
from wearsim.mechanics.numerics import jit
from wearsim.mechanics.tangential.strip_theory import strip_contacts
wearsim.solve_contact(wearsim.load_scenario(r"{SCENARIOS / "rig-450min.toml"}"))
folder = jit._cache_folder()
print(json.dumps([str(folder), len(strip_contacts.dispatcher.stats.cache_misses)]))
"""


@pytest.mark.slow
def test_kernel_compiled_by_another_process_is_read_from_the_cache(tmp_path: Path):
    of_tests, _ = run(SLENDER)
    kernels = shutil.ignore_patterns("*.strip_contacts-*")
    shutil.copytree(of_tests, tmp_path / Path(of_tests).name, ignore=kernels)
    code = "import json; from wearsim.mechanics.tangential import strip_theory as m;"
    names = "from wearsim.mechanics.numerics.jit import not_cached; print(json.dumps("
    names += "sorted(not_cached(['strip_contacts', 'solve_slender']))))"
    assert run(f"{code} {names}", NUMBA_CACHE_DIR=tmp_path) == ["strip_contacts"]
    assert run(f"{code} m.compile_strip_contacts(); {names}", NUMBA_CACHE_DIR=tmp_path) == []
    assert run(SLENDER, NUMBA_CACHE_DIR=tmp_path)[1] == 0


@pytest.mark.slow
def test_read_only_install_runs_without_any_cache(site: Path, tmp_path: Path):
    make_read_only(site)
    (tmp_path / "nowhere").write_text("not a folder")
    nowhere = tmp_path / "nowhere" / "home"
    environment = {"PYTHONPATH": site, "XDG_CACHE_HOME": nowhere, "HOME": nowhere}
    results = run(CONTACT, **environment)
    assert Path(results["file"]).is_relative_to(site)
    assert results["path"] is None
    assert results["bits"] == run(CONTACT)["bits"]


def test_cache_is_renewed_when_a_callee_elsewhere_changes(site: Path, tmp_path: Path):
    mechanics = site / "wearsim" / "mechanics"
    callers, callees = mechanics / "slender", mechanics / "hertz"
    head = "from wearsim.mechanics.numerics.jit import kernel, subroutine\n"
    body = "\n\n@{kind}\ndef {name}(x: float) -> float:\n    return {value}\n"
    outer = body.format(kind="kernel", name="outer", value="2.0 * inner(x)")
    (callers / "outer.py").write_text(
        head + "from wearsim.mechanics.hertz.inner import inner\n" + outer
    )
    found = []
    for value in ("x + 1.0", "x + 3.0"):
        (callees / "inner.py").write_text(
            head + body.format(kind="subroutine", name="inner", value=value)
        )
        code = "from wearsim.mechanics.slender.outer import outer; print(outer(1.0))"
        # bytecode of a file of equal size that is written again within a second is not renewed
        places = {"PYTHONPATH": site, "NUMBA_CACHE_DIR": tmp_path / "cache"}
        found.append(run(code, PYTHONDONTWRITEBYTECODE=1, **places))
    assert found == [4.0, 8.0]


@pytest.fixture
def cache_folder(site: Path, tmp_path: Path) -> Iterator[Callable[[Path | None], Path | None]]:
    """Return a function that gives the folder of the kernels of `site` as in a new process."""

    def folder(of_user: Path | None = None) -> Path | None:
        jit.cache_folder.cache_clear()
        home = str(tmp_path / "home")
        return jit.cache_folder(site / "wearsim" / "mechanics", str(of_user or ""), home)

    yield folder
    jit.cache_folder.cache_clear()


def test_unwritable_folder_of_the_user_falls_back_to_the_next(site, tmp_path, cache_folder):
    (tmp_path / "file").write_text("not a folder")
    cache = site / "wearsim" / "mechanics" / "__pycache__"
    assert cache_folder(tmp_path / "file").is_relative_to(cache)


def test_kernels_of_former_sources_are_removed_after_a_day(site, cache_folder):
    cache = site / "wearsim" / "mechanics" / "__pycache__"
    source = site / "wearsim" / "mechanics" / "hertz" / "elasticity.py"
    for days in (2, 0.5, 0):
        folder = cache_folder()
        then = time.time() - 86400 * days
        os.utime(folder, (then, then))
        source.write_text(source.read_text() + "\n")
    assert len(list(cache.glob("wearsim-*"))) == 2


def test_kernels_of_other_installs_are_kept_in_a_shared_folder(tmp_path, cache_folder):
    other = tmp_path / "cache" / "wearsim-0123abcd-0123456789ab"
    other.mkdir(parents=True)
    os.utime(other, (0.0, 0.0))
    cache_folder(tmp_path / "cache")
    assert other.is_dir()
    assert len(list(other.parent.iterdir())) == 2
