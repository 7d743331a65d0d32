"""Checks of the name of a results file before a study starts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.atomic_write import refuse_if_locked, refuse_inputs, write_lock
from wearsim.errors import ResultsFileError, WearsimError
from wearsim.results.io.files import as_path, read_file

if TYPE_CHECKING:
    from wearsim.results.io.stored_file import StoredFile

_OTHER_KINDS = (".png", ".pdf", ".svg", ".toml", ".csv")


def check_output(path: str | Path, force: bool, inputs: Iterable[Path] = ()) -> None:
    """Check before a long computation that a results file may be written.

    Parameters
    ----------
    path : str or Path
        The file.
    force : bool
        Whether an existing file may be replaced.
    inputs : iterable of Path
        Files of the scenario, which are never replaced.

    Raises
    ------
    ResultsFileError
        If the file exists and `force` is not set, is an input, has the suffix of a figure, a
        scenario or a table, is being written by another process, or if its folder is missing or
        not writable.
    """
    path = as_path(path)
    if force not in {True, False}:  # "no" would replace a file
        raise TypeError(f"force must be True or False, got {force!r}")
    refuse_inputs(path, inputs)
    target = path.resolve()
    folder, other = target.parent, f"choose another, such as {path.stem}.h5"
    refusals = (
        (path.suffix.lower() in _OTHER_KINDS, f"no results file ends in {path.suffix}", other),
        (target.is_dir(), "is a folder", "name a file in it"),
        (not folder.is_dir(), f"there is no folder {folder}", "make it, or choose another"),
        (target.exists() and not target.is_file(), "is not a regular file", "choose another"),
    )
    for refused, what, remedy in refusals:
        if refused:
            raise _refused(path, what, remedy)
    refuse_if_locked(path)
    if not force:
        _refuse_existing(path)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise _refused(path, f"the folder {folder} is not writable", "choose another")


@contextmanager
def output_lock(
    path: str | Path | None, force: bool, inputs: Iterable[Path] = ()
) -> Iterator[None]:
    """Make this process the only writer of a results file, if there is one, in the context.

    Parameters
    ----------
    path : str or Path, optional
        The file.
    force, inputs
        As of `check_output`.

    Raises
    ------
    ResultsFileError
        As `check_output`, or if another process has written it since it was checked.
    """
    if path is None:
        yield
        return
    check_output(path, force, inputs)
    with write_lock(path):
        if not force:
            _refuse_existing(path)
        yield


def _refuse_existing(path: str | Path) -> None:
    """Raise ResultsFileError if a results file exists; it says how to continue or replace it."""
    if not Path(path).resolve().exists():
        return
    verb = _continuing(path)
    python = f'wearsim.{verb}("{path}") continues it, ' if verb else ""
    shell = f"`wearsim resume {path}` continues it, " if verb else ""
    raise ResultsFileError(
        f"{path}: already exists{' and is unfinished' if verb else ''}",
        python=f"{python}force=True replaces it, output=... chooses another",
        shell=f"{shell}--force replaces it, -o chooses another",
    )


def _continuing(path: str | Path) -> str:
    """Return the function that continues an unfinished study; "" for any other file."""
    # by a variable that only files of this kind have
    verbs = {"step": "resume", "realisation": "resume_ensemble"}

    def take(file: StoredFile) -> tuple[Any, str]:
        known = (verb for name, verb in verbs.items() if name in file)
        return file.attribute("finished"), next(known, "")

    try:
        finished, known = read_file(path, take)
        if finished:
            return ""
        from wearsim.results.kinds import kind_of  # noqa: PLC0415  (imports the plugins)

        return known or kind_of(path).resume.rpartition(":")[2]
    except WearsimError:  # not a results file, damaged, or of a plugin that is not installed
        return ""


def _refused(path: str | Path, what: str, remedy: str) -> ResultsFileError:
    """Return the error of an output, with the argument and the option that set its name."""
    return ResultsFileError(
        f"{path}: {what}", python=f"{remedy} as output", shell=f"{remedy} with -o"
    )
