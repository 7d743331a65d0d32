"""Damaged, altered and hostile results files of every kind, each opened in a separate process.

`python -m tests.damaged_files --files 1000 --seed 1` prints what became of them. A damaged file
must be refused in one line, or have the numbers that it had before; a hostile one must be refused.
An altered one, whose checksums are right, may have other numbers or raise an exception. None may
take more than 1 GB or 5 s of processor time, wait for another file, or crash. Linux only.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import wearsim
from tests.studies import test_every_kind as examples
from wearsim.errors import WearsimError
from wearsim.results.content import ABOUT, FILES, INPUTS, SCENARIO
from wearsim.results.io import hdf5_write
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.testing.study_kinds import STUDY_KIND  # noqa: F401  (fixture of the examples)

MEMORY = 1_000_000_000  # bytes
SECONDS = 5  # of processor time
PATIENCE = 60  # seconds of a busy machine, for files that wait for something
Change = Callable[[Path, np.random.Generator], str]


def unfinished(folder: Path) -> Any:
    """Return an ensemble with a part."""
    shutil.copy(folder / "tests.h5", folder / "unfinished.h5")
    with EnsembleFile.open(folder / "unfinished.h5") as file:
        file.clear([1, 4])
    return wearsim.open_results(folder / "unfinished.h5")


def optimisation(folder: Path) -> Any:
    """Return an optimisation of wearsim-optimise."""
    scenario = shipped_scenario("rig-450min", {"contact.strips": 41, "operation.rollers": 1})
    options: dict[str, Any] = {"minimise": "contact.power", "starts": 1, "evaluations": 4}
    vary, path = ["roller.crown_radius=300mm:900mm"], folder / "optimisation.h5"
    return wearsim.optimise(scenario, vary, path, scheduler="serial", confirm=False, **options)


KINDS = {
    "run": examples.run,
    "cam": examples.cam_run,
    "dissipation": examples.dissipation,
    "ensemble": examples.ensemble,
    "unfinished": unfinished,
    "life": examples.life,
    "identification": examples.identification,
    **({"optimisation": optimisation} if find_spec("wearsim_optimise") else {}),
}


# damage: bytes are changed, and checksums are not


def flip(path: Path, rng: np.random.Generator) -> str:
    """Change some bits."""
    content = np.fromfile(path, np.uint8)
    at = rng.integers(len(content), size=rng.integers(1, 9))
    content[at] ^= np.uint8(1) << rng.integers(8, size=len(at), dtype=np.uint8)
    content.tofile(path)
    return f"bits of bytes {at.tolist()}"


def overwrite(path: Path, rng: np.random.Generator) -> str:
    """Overwrite a block with noise, zeros, or another block."""
    content = np.fromfile(path, np.uint8)
    size = int(rng.integers(1, min(4096, len(content))))
    start, other = rng.integers(len(content) - size + 1, size=2)
    new = [rng.integers(256, size=size), np.zeros(size), content[other : other + size].copy()]
    content[start : start + size] = new[rng.integers(3)]
    content.tofile(path)
    return f"bytes {start} to {start + size}"


def cut(path: Path, rng: np.random.Generator) -> str:
    """Cut off the end, take out a block, or add one."""
    content, what = path.read_bytes(), rng.integers(3)
    start, stop = sorted(rng.integers(len(content), size=2).tolist())
    parts = {
        0: content[:start],
        1: content[:start] + content[stop:],
        2: content[:start] + rng.bytes(64) + content[start:],
    }
    path.write_bytes(parts[int(what)])
    return f"length {len(content)} to {path.stat().st_size}"


# alterations: other values with the right checksums

ODD: list[Any] = [None, True, -1, 0, 2**70, 1e308, -1e-300, float("nan"), "", "x", "9" * 5000]
ODD += [[], {}, [[]], {"a": 1}, "../../../etc/passwd", "\x1b[31m", "\ud800", "<script>"]


def _replaced(value: Any, rng: np.random.Generator) -> Any:
    """Return a value of JSON in which one part is replaced or removed."""
    if isinstance(value, dict | list) and value and rng.random() < 0.9:
        keys = list(value) if isinstance(value, dict) else list(range(len(value)))
        key = keys[rng.integers(len(keys))]
        copy = value.copy()
        if rng.random() < 0.1:
            del copy[key]
        else:
            copy[key] = _replaced(value[key], rng)
        return copy
    return ODD[rng.integers(len(ODD))]


def _put_text(file: h5py.File, place: str, text: str) -> None:
    del file[place]
    folder, _, name = place.rpartition("/")
    hdf5_write.put_text(file[folder], name, text)


def fields(path: Path, rng: np.random.Generator) -> str:
    """Replace a value of JSON by one of another type or size."""
    with h5py.File(path, "r+") as file:
        name = ABOUT if rng.random() < 0.9 else FILES
        place = f"{INPUTS}/{name}"
        content = json.loads(file[place][:].tobytes()[:-1])
        changed = _replaced(content, rng)
        _put_text(file, place, json.dumps(changed))
    keys = content.keys() ^ changed.keys() if isinstance(changed, dict) else {"all"}
    keys |= {key for key in content if isinstance(changed, dict) and key in changed and
             repr(content[key]) != repr(changed[key])}  # fmt: skip
    return f"{name} {sorted(keys)}"


def scenario(path: Path, rng: np.random.Generator) -> str:
    """Change characters of the scenario."""
    with h5py.File(path, "r+") as file:
        place = f"{INPUTS}/{SCENARIO}"
        text = list(file[place][:].tobytes()[:-1].decode())
        for _ in range(rng.integers(1, 4)):
            text[rng.integers(len(text))] = '0"[]={}\n.-e\0µ'[rng.integers(12)]
        _put_text(file, place, "".join(text))
    return "characters of the scenario"


def arrays(path: Path, rng: np.random.Generator) -> str:
    """Replace an array by odd numbers, another shape or another type."""
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if hasattr(item, "dtype") else None)
        name = names[rng.integers(len(names))]
        old, what = file[name][()], int(rng.integers(6))
        del file[name]
        if what < 3 and old.dtype.kind == "f" and old.size:
            new = np.array(old)
            new[tuple(rng.integers(length) for length in new.shape)] = [np.nan, 1e308, -1.0][what]
            file[name] = new
        elif what == 3:
            file[name] = np.resize(old, (*old.shape, 2))
        elif what == 4:
            file[name] = np.zeros(old.shape, [np.float32, np.int64, "S3", bool][rng.integers(4)])
        elif what == 5:
            file[name] = old[:1] if old.ndim else [old]
    return f"{name} {old.shape}, change {what}"


# hostility: what files of wearsim never hold


def _external_link(file: h5py.File, name: str, other: Path) -> None:
    file[name] = h5py.ExternalLink(str(other), name)


def _waiting_link(file: h5py.File, name: str, other: Path) -> None:
    os.mkfifo(other.with_suffix(".fifo"))  # whoever opens it waits
    file[name] = h5py.ExternalLink(str(other.with_suffix(".fifo")), name)


def _soft_link(file: h5py.File, name: str, other: Path) -> None:
    file[name] = h5py.SoftLink("/inputs/about")


def _loop(file: h5py.File, name: str, other: Path) -> None:
    file[name] = h5py.SoftLink(f"/{name}")


def _folder(file: h5py.File, name: str, other: Path) -> None:
    file.create_group(name)


def _external_array(file: h5py.File, name: str, other: Path) -> None:
    place = [("/etc/passwd", 0, h5py.h5f.UNLIMITED)]
    file.create_dataset(name, (5,), "<f8", external=place)


def _virtual(file: h5py.File, name: str, other: Path) -> None:
    layout = h5py.VirtualLayout((5,), "<f8")
    layout[:] = h5py.VirtualSource(str(other), name, (5,))
    file.create_virtual_dataset(name, layout)


def _unwritten(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, (10**12,), "<f8", chunks=(1 << 15,))


def _large_chunk(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, (4,), "<f8", chunks=(1 << 28,), maxshape=(None,), fillvalue=1.0)


def _compressed(file: h5py.File, name: str, other: Path) -> None:
    stored = file.create_dataset(name, (1 << 27,), "<f8", chunks=(1 << 27,), compression="gzip")
    packed = other.with_suffix(".gz")
    stored.id.write_direct_chunk((0,), packed.read_bytes())


def _long_text(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, (1,), "S2000000000", chunks=(1,))


def _variable_text(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, (1 << 16,), h5py.string_dtype())


def _references(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, data=np.array([file.ref] * 5, h5py.ref_dtype))


def _table(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, data=np.zeros(5, [("a", "f8"), ("b", "V100000")]))


HOSTILE = (
    *(_external_link, _waiting_link, _soft_link, _loop, _folder, _external_array, _virtual),
    *(_unwritten, _large_chunk, _compressed, _long_text, _variable_text, _references, _table),
)


def hostile(path: Path, rng: np.random.Generator) -> str:
    """Replace an object that is read by one that no file of wearsim holds, or an attribute."""
    change = HOSTILE[rng.integers(len(HOSTILE))]
    with h5py.File(path, "r+") as file:
        read = [f"{INPUTS}/{name}" for name in (ABOUT, SCENARIO, FILES)]
        read += [name for name in ("depth", "status", "power", "y", "posterior") if name in file]
        read += [f"checkpoint/{name}" for name in file["checkpoint"]]
        if rng.random() < 0.1:
            file.attrs["format"] = ["x" * 60_000] * 2
            return "two long texts as the attribute format"
        name = read[rng.integers(len(read))]
        del file[name]
        change(file, name, path.with_name("other.h5"))
    return f"{name} becomes{change.__name__.replace('_', ' ')}"


def deep(path: Path, rng: np.random.Generator) -> str:
    """Replace the fields by many lists in lists."""
    with h5py.File(path, "r+") as file:
        depth = int(rng.integers(10, 100_000))
        _put_text(file, f"{INPUTS}/{ABOUT}", '{"title": ' + "[" * depth + "]" * depth + "}")
    return f"{depth} lists in lists"


DAMAGE: tuple[Change, ...] = (flip, overwrite, cut)
ALTERED: tuple[Change, ...] = (fields, fields, scenario, arrays)
HOSTILITY: tuple[Change, ...] = (hostile, hostile, hostile, deep)


def answers(path: Path) -> str:
    """Return all that is shown of a file, as text."""
    result = wearsim.open_results(path)
    view = result.view
    rows = [(row.label, str(row.quantity)) for row in view.rows()]
    return repr((rows, json.dumps(view.data(), default=str, sort_keys=True)))


@dataclass(frozen=True)
class Opened:
    """What became of a file: `outcome` is refused, same, other or a failure, `text` says why."""

    kind: str
    change: str
    what: str
    outcome: str
    text: str
    memory: float  # bytes
    seconds: float  # of processor time


def _limited() -> None:
    """Limit memory and processor time of this process."""
    pages = [int(number) * resource.getpagesize() for number in
             Path("/proc/self/statm").read_text(encoding="ascii").split()[:2]]  # fmt: skip
    address_space = pages[0] + MEMORY - pages[1]
    resource.setrlimit(resource.RLIMIT_AS, (address_space, address_space))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    signal.alarm(PATIENCE)


def _opened(path: Path, before: str) -> tuple[str, str]:
    """Open a file in this process, and return the outcome and the reason."""
    warnings.simplefilter("ignore")  # numpy's, on odd numbers
    try:
        now = answers(path)
    except WearsimError as error:
        text = error.at_shell
        one_line = len(text.splitlines()) == 1 and text.isprintable()
        return ("refused" if one_line else "not one line"), text
    except MemoryError:
        return "memory", f"more than {MEMORY:g} bytes"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        return "exception", f"{type(error).__name__}: {error} at {where}"[:300]
    if now == before:
        return "same", ""
    at = next((k for k, (a, b) in enumerate(zip(now, before, strict=False)) if a != b), 0)
    return "other", f"{before[max(at - 60, 0) : at + 60]} became {now[max(at - 60, 0) : at + 60]}"


def in_process(path: Path, before: str) -> tuple[str, str, float, float]:
    """Open a file in a forked process; return outcome, reason, memory and processor time."""
    source, target = os.pipe()
    pid = os.fork()
    if not pid:
        os.close(source)
        _limited()
        with os.fdopen(target, "wb") as stream:
            stream.write(json.dumps(_opened(path, before)).encode())
        os._exit(0)
    os.close(target)
    with os.fdopen(source, "rb") as stream:
        content = stream.read()
    _, status, usage = os.wait4(pid, 0)
    outcome, text = json.loads(content) if content else ("killed", f"status {status}")
    return outcome, text, usage.ru_maxrss * 1024.0, usage.ru_utime + usage.ru_stime


def _packed_zeros(size: int) -> bytes:
    """Return so many zeros, compressed, without the checksum at the end."""
    packer, block = zlib.compressobj(1), bytes(1 << 24)
    first, second = (packer.compress(block) + packer.flush(zlib.Z_FULL_FLUSH) for _ in range(2))
    return first + second * (size // len(block) - 1)


def opened(files: int, seed: int, folder: Path) -> Iterator[Opened]:
    """Yield what becomes of damaged, altered and hostile files, all kinds and changes in turn."""
    rng = np.random.default_rng(seed)
    made, work = folder / "made", folder / "work"
    made.mkdir()
    known: dict[str, tuple[Path, str]] = {}
    for kind, make in KINDS.items():
        path = make(made).path
        shown = str(work / path.name)
        known[kind] = (path, answers(path).replace(str(path), shown))
    packed = _packed_zeros(1 << 30)
    changes = [*DAMAGE, *ALTERED, *HOSTILITY]
    for number in range(files):
        kind = list(KINDS)[number % len(KINDS)]
        change = changes[number // len(KINDS) % len(changes)]
        work.mkdir()
        path, before = known[kind]
        copied = Path(shutil.copy(path, work / path.name))
        (work / "other.gz").write_bytes(packed)
        shutil.copy(path, work / "other.h5")
        changed = copied
        parts = path.with_name(f"{path.name}.parts")
        if parts.is_dir():
            shutil.copytree(parts, work / parts.name)
            part = work / parts.name / "000001.h5"
            changed = part if change in DAMAGE and rng.random() < 0.5 and part.exists() else copied
        what = change(changed, rng)
        yield Opened(kind, change.__name__, what, *in_process(copied, before))
        shutil.rmtree(work)


def failures(found: list[Opened]) -> list[Opened]:
    """Return the files that were neither refused in one line nor had numbers they may have."""
    kinds = {DAMAGE: {"refused", "same"}, ALTERED: {"refused", "same", "other", "exception"}}
    allowed = {change.__name__: known for changes, known in kinds.items() for change in changes}
    return [
        item
        for item in found
        if item.outcome not in allowed.get(item.change, {"refused"})
        or item.memory > MEMORY
        or item.seconds > SECONDS
    ]


def main() -> int:
    """Print what became of the files; return 1 if one failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = list(opened(options.files, options.seed, Path(folder)))
    wrong, write = failures(found), sys.stdout.write
    counts = Counter((item.change, item.outcome) for item in found)
    for (change, outcome), count in sorted(counts.items()):
        write(f"{change:12} {outcome:14} {count:5}\n")
    write(f"most memory {max(item.memory for item in found) / 1e6:.0f} MB\n")
    write(f"most processor time {max(item.seconds for item in found):.2f} s\n")
    for item in wrong:
        what = (item.kind, item.change, item.what, item.outcome, ascii(item.text))
        write(" | ".join(what) + "\n")
    write(f"{len(wrong)} of {len(found)} files failed\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
