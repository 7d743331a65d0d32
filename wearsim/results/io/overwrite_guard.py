"""Checks of an output path before a computation; input files are never replaced."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from wearsim.errors import ResultsFileError
from wearsim.results.io.file_lock import refuse_if_locked

# suffixes of figures, scenarios and tables, which are refused for results files
_OTHER_KINDS = (".png", ".pdf", ".svg", ".toml", ".csv")


def refuse_inputs(
    path: str | Path, inputs: Iterable[Path], what: str = "the scenario", option: str = "-o"
) -> None:
    """Raise if an output would replace an input file.

    Parameters
    ----------
    path : str or Path
        The output.
    inputs : iterable of Path
        The input files.
    what : str
        Description of the inputs.
    option : str
        The option that set the output.

    Raises
    ------
    ResultsFileError
        If the output is one of the inputs, also by another name.
    """
    for source in inputs:
        if same_file(path, source):
            raise ResultsFileError(
                f"{path}: {what} is read from {source}, and --force replaces no input; choose"
                f" another name with {option}"
            )


def same_file(one: str | Path, other: str | Path) -> bool:
    """Return whether two paths refer to the same file.

    Parameters
    ----------
    one, other : str or Path
        The paths; the files need not exist.

    Returns
    -------
    bool
    """
    try:
        return os.path.samefile(one, other)
    except OSError:  # one of them does not exist
        return Path(one).resolve() == Path(other).resolve()


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
    refuse_inputs(path, inputs)
    target, suffix = Path(path).resolve(), Path(path).suffix
    folder = target.parent
    if suffix.lower() in _OTHER_KINDS:
        raise ResultsFileError(
            f"{path}: no results file ends in {suffix}; choose another name with -o, such as"
            f" {Path(path).with_suffix('.h5').name}"
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
        refuse_if_locked(path)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ResultsFileError(f"{path}: the folder {folder} is not writable; choose with -o")
