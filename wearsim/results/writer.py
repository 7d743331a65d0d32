"""Files written whole or not at all: a kill at any moment leaves the old one or the new one."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from wearsim.errors import ResultsFileError
from wearsim.results.data import RunData
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.inputs import refuse_inputs

OTHER_KINDS = (".png", ".pdf", ".svg", ".toml", ".csv")
"""How names end that mean a figure, a scenario or a table."""

STAGES = ("open", "write", "flush", "fsync", "close", "rename", "fsync folder")

_CHUNK = 1 << 18


def _do_nothing(stage: str) -> None:
    pass


on_write_stage: Callable[[str], None] = _do_nothing
"""The seam for fault injection, called with "before <stage>" and "after <stage>" at each of STAGES.

A file is written in chunks, each a "write" of its own. A test sets this to something that raises
or kills the process.
"""


@contextmanager
def _stage(name: str) -> Iterator[None]:
    on_write_stage(f"before {name}")
    yield
    on_write_stage(f"after {name}")


def write_results(path: str | Path, data: RunData | DissipationData) -> None:
    """Write a results file, in place of any that stands there.

    Parameters
    ----------
    path : str or Path
        The file.
    data : RunData or DissipationData
        What it shall hold.

    Raises
    ------
    ResultsFileError
        If it cannot be written; a file that stood there is untouched.
    ValueError
        If the variables are not those of the layout, or do not fit together.
    """
    from wearsim.results import hdf5  # noqa: PLC0415  (h5py takes 0.2 s to import)

    write_whole(path, hdf5.file_image(data.content))


def write_whole(path: str | Path, content: bytes) -> None:
    """Write a file so that its name only ever stands for a whole one.

    Parameters
    ----------
    path : str or Path
        The file; the content goes to `path`.part first.
    content : bytes
        What it shall hold.

    Raises
    ------
    ResultsFileError
        If it cannot be written; a file that stood there is untouched.
    """
    target = Path(path).resolve()  # where a link points: the link stays one
    part = target.with_name(target.name + ".part")
    try:
        try:
            _write_part(part, content)
            with _stage("rename"):
                os.replace(part, target)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
        with _stage("fsync folder"):
            _sync_folder(target.parent)
    except OSError as error:
        raise ResultsFileError(f"{path}: cannot be written ({error.strerror or error})") from error


def _write_part(part: Path, content: bytes) -> None:
    view = memoryview(content)
    on_write_stage("before open")
    with part.open("wb") as file:
        on_write_stage("after open")
        for start in range(0, len(view), _CHUNK):
            with _stage("write"):
                file.write(view[start : start + _CHUNK])
        with _stage("flush"):
            file.flush()
        with _stage("fsync"):
            os.fsync(file.fileno())
        with _stage("close"):
            file.close()


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def check_output(path: str | Path, force: bool, inputs: Iterable[Path] = ()) -> None:
    """Check that a results file may be written, before hours are spent on it.

    Parameters
    ----------
    path : str or Path
        The file.
    force : bool
        Whether an existing file may be replaced.
    inputs : iterable of Path
        Files that the scenario is read from, which are never replaced.

    Raises
    ------
    ResultsFileError
        If it exists and `force` is not set, if it is an input, if its name is that of a figure, a
        scenario or a table, or if its folder is missing or not writable.
    """
    refuse_inputs(path, inputs)
    target = Path(path).resolve()
    folder = target.parent
    suffix = Path(path).suffix
    if suffix.lower() in OTHER_KINDS:
        name = Path(path).with_suffix(".h5").name
        raise ResultsFileError(
            f"{path}: no results file ends in {suffix}; choose another name with -o, such as {name}"
        )
    if target.is_dir():
        raise ResultsFileError(f"{path}: is a folder; name a file in it with -o")
    if not folder.is_dir():
        raise ResultsFileError(f"{path}: there is no folder {folder}; make it, or choose with -o")
    if target.exists():
        if not target.is_file():
            raise ResultsFileError(f"{path}: is not a regular file; choose another with -o")
        if not force:
            raise ResultsFileError(
                f"{path}: already exists; --force replaces it, -o chooses another"
            )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ResultsFileError(f"{path}: the folder {folder} is not writable; choose with -o")
