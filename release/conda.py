"""Build and test the conda package of the recipe without a conda channel.

``python release/conda.py`` makes a local channel of this environment: Python and the distributions
of wheels that `release/recipe.yaml` requires, each as a conda package. `rattler-build` then builds
the recipe from `dist/wearsim-<version>.tar.gz` and runs its tests, as it does with conda-forge.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import sys
import sysconfig
from importlib.metadata import Distribution, distribution
from pathlib import Path
from tempfile import TemporaryDirectory

import rattler_build
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
RECIPE = ROOT / "release" / "recipe.yaml"
PLATFORM = "linux-64"
VERSION = sysconfig.get_python_version()
LIBRARY = Path("lib", f"python{VERSION}")
PIP_NAMES = {"matplotlib-base": "matplotlib"}
LEFT_OUT = ("site-packages", "test", "idlelib", "__pycache__", "config-*", "*.a", "ensurepip")


def required(names: list[str]) -> dict[str, Distribution]:
    """Return distributions and all that they require here, by normalised name."""
    found: dict[str, Distribution] = {}
    left = list(names)
    while left:
        name = re.sub(r"[-_.]+", "-", left.pop()).lower()
        if name in found:
            continue
        found[name] = distribution(name)
        for text in found[name].requires or ():
            need = Requirement(text)
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                left.append(need.name)
    return found


def stage_python(folder: Path) -> None:
    """Copy the interpreter and its library."""
    base, ignored = Path(sys.base_prefix), shutil.ignore_patterns(*LEFT_OUT)
    shutil.copytree(base / LIBRARY, folder / LIBRARY, ignore=ignored)
    (folder / "bin").mkdir()
    for name in ("python", "python3", f"python{VERSION}"):
        shutil.copy2(base / "bin" / f"python{VERSION}", folder / "bin" / name)
    for shared in (base / "lib").glob("libpython*.so*"):
        shutil.copy2(shared, folder / "lib" / shared.name)


def stage_wheel(one: Distribution, folder: Path) -> None:
    """Copy the files of a distribution, without scripts and bytecode."""
    for path in one.files or ():
        if ".." not in path.parts and path.suffix != ".pyc":
            target = folder / LIBRARY / "site-packages" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(str(path.locate()), target)


def add_package(channel: Path, name: str, version: str, folder: Path, depends: list[str]) -> None:
    """Add the files of a folder to a channel, as a package."""
    made = rattler_build.assemble_package(
        name,
        version,
        PLATFORM,
        "local_0",
        channel,
        files_dir=folder,
        depends=depends,
        compression_level=1,
        detect_prefix=False,
    )
    path = channel / PLATFORM / made.path.name
    if made.path != path:
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(made.path, path)
    record = {
        "name": name,
        "version": version,
        "build": "local_0",
        "build_number": 0,
        "depends": depends,
        "subdir": PLATFORM,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "size": path.stat().st_size,
    }
    index = channel / PLATFORM / "repodata.json"
    listed = {"info": {"subdir": PLATFORM}, "packages": {}, "packages.conda": {}}
    if index.exists():
        listed = json.loads(index.read_text(encoding="utf-8"))
    listed["packages.conda"][path.name] = record
    index.write_text(json.dumps(listed), encoding="utf-8")


def make_channel(channel: Path, names: list[str]) -> None:
    """Write the packages that a recipe requires, by conda name, and all that they require."""
    (channel / "noarch").mkdir(parents=True)
    empty = {"info": {"subdir": "noarch"}, "packages": {}, "packages.conda": {}}
    (channel / "noarch" / "repodata.json").write_text(json.dumps(empty), encoding="utf-8")
    with TemporaryDirectory() as folder:
        stage_python(Path(folder))
        add_package(channel, "python", sys.version.split()[0], Path(folder), [])
    conda_names = {of_pip: name for name, of_pip in PIP_NAMES.items()}
    wheels = required([PIP_NAMES.get(name, name) for name in names])
    for name, one in wheels.items():
        with TemporaryDirectory() as folder:
            stage_wheel(one, Path(folder))
            needs = [conda_names.get(need, need) for need in required([name]) if need != name]
            depends = [f"python {VERSION}.*", *needs]
            add_package(channel, conda_names.get(name, name), one.version, Path(folder), depends)


def main() -> None:
    """Build the package into `out/conda`, and test it."""
    needs = yaml.safe_load(RECIPE.read_text(encoding="utf-8"))["requirements"]
    names = {item.split()[0] for item in (*needs["host"], *needs["run"])} - {"python"}
    output = ROOT / "out" / "conda"
    shutil.rmtree(output, ignore_errors=True)
    channel = output / "channel"
    make_channel(channel, sorted(names))
    recipe = rattler_build.Stage0Recipe.from_file(RECIPE)
    (built,) = recipe.run_build(channels=[channel.as_uri()], output_dir=output / "built")
    for path in built.packages:
        package = rattler_build.Package.from_file(path)
        results = package.run_tests(channel=[channel.as_uri()])
        if len(results) != package.test_count or not all(result.success for result in results):
            raise SystemExit("\n".join(str(result.output) for result in results))
        sys.stdout.write(f"{path}: built, {len(results)} tests passed\n")


if __name__ == "__main__":
    main()
