"""Files that are read stay as they are: no output may take their place, not even by force."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from wearsim.errors import ResultsFileError


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
