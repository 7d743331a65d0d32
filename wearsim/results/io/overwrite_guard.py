"""Files that are read stay as they are: no output may take their place, not even by force."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from wearsim.errors import ResultsFileError
from wearsim.results.io.file_lock import refuse_if_locked


def refuse_inputs(
    path: str | Path, inputs: Iterable[Path], what: str = "the scenario", option: str = "-o"
) -> None:
    """Raise if an output would replace a file that is read.

    Parameters
    ----------
    path : str or Path
        The output.
    inputs : iterable of Path
        The files that are read.
    what : str
        What is read from them.
    option : str
        The option that named the output.

    Raises
    ------
    ResultsFileError
        If it is one of them, by whatever name.
    """
    for source in inputs:
        if same_file(path, source):
            raise ResultsFileError(
                f"{path}: {what} is read from {source}, and --force replaces no input; choose"
                f" another name with {option}"
            )


def same_file(one: str | Path, other: str | Path) -> bool:
    """Tell whether two paths name one file, which need not exist.

    Parameters
    ----------
    one, other : str or Path

    Returns
    -------
    bool
    """
    try:
        return os.path.samefile(one, other)
    except OSError:  # one of them is not there yet
        return Path(one).resolve() == Path(other).resolve()


OTHER_KINDS = (".png", ".pdf", ".svg", ".toml", ".csv")
"""How names end that mean a figure, a scenario or a table."""


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
        scenario or a table, if its folder is missing or not writable, or if another process is
        writing it.
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
        refuse_if_locked(path)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ResultsFileError(f"{path}: the folder {folder} is not writable; choose with -o")
