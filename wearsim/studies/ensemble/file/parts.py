"""Part files of an ensemble, and reading of an ensemble with its parts.

Parts are rows of realisations until they are merged into the file of the ensemble. They are in a
folder beside it, rig.h5.parts for rig.h5, and have numbers in the order in which they were written.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.atomic_write import Storage, parts_folder
from wearsim.errors import ResultsFileError
from wearsim.results.content import Array, Arrays, Schema, as_plain, axis_lengths
from wearsim.results.io.files import (
    as_path,
    check_complete,
    check_layout,
    format_of,
    read_attributes,
    read_file,
)
from wearsim.results.io.stored_file import StoredFile
from wearsim.studies.ensemble.file.data import (
    EnsembleData,
    Outcome,
    StoredRows,
    small_variables,
)
from wearsim.studies.ensemble.file.schema import (
    DONE,
    ENSEMBLE,
    ERROR_BYTES,
    FAILED,
    KEPT,
    PENDING,
    ensemble_schema,
    is_row,
    type_of,
)
from wearsim.types import IntArray

PART = Schema(f"{ENSEMBLE.format}-part", ENSEMBLE.version, "rows of an ensemble", {}, {})
NUMBER, STATE, RUN_ID = "number", "state", "run_id"

_REMOVE = "remove all parts of greater numbers: resume then repeats the tests that are lost"
ERROR_ROWS = 1 << 16  # of error messages that are read at a time


@dataclass(frozen=True, eq=False)
class Part:
    """A part file.

    Parameters
    ----------
    path : Path
        The file.
    numbers : ndarray of int
        Numbers of its realisations, ascending.
    status : ndarray
        PENDING, DONE or FAILED of each; PENDING if it is to be run again.
    errors : dict of int to str
        Error messages of failed realisations by their number.
    state : dict of str to object
        Fields of `EnsembleData` that changed since the file of the ensemble was written.
    """

    path: Path
    numbers: IntArray
    status: Array
    errors: dict[int, str]
    state: dict[str, Any]

    def put_rows(self, rows: Arrays, start: int, *rest: slice) -> None:
        """Replace those rows of variables that are in this part.

        Parameters
        ----------
        rows : dict of str to ndarray
            Consecutive rows of each variable, of the same realisations.
        start : int
            Number of the first realisation in `rows`.
        *rest : slice
            The entries along further axes that the rows have.
        """

        def put(file: StoredFile) -> None:
            for name, array in rows.items():
                first, last = np.searchsorted(self.numbers, (start, start + len(array))).tolist()
                if first < last:
                    stored = file.array(name, (slice(first, last), *rest))
                    # not all profiles are kept
                    array[self.numbers[first : first + len(stored)] - start] = stored

        most = max(map(len, rows.values()), default=0)
        first, last = np.searchsorted(self.numbers, (start, start + most)).tolist()
        if first < last:
            read_file(self.path, put)


def part_numbers(path: Path) -> list[int]:
    """Return the numbers of the parts beside the file of an ensemble, ascending."""
    return sorted(int(part.stem) for part in parts_folder(path).glob("*.h5") if part.stem.isdigit())


def part_path(path: Path, number: int) -> Path:
    """Return the path of a part of an ensemble."""
    return parts_folder(path) / f"{number:06d}.h5"


def read_parts(path: Path, data: EnsembleData) -> list[Part]:
    """Read the parts of an ensemble that are not merged into its file.

    Parameters
    ----------
    path : Path
        The file of the ensemble.
    data : EnsembleData
        Its content.

    Raises
    ------
    ResultsFileError
        If parts are missing, damaged, or of another ensemble.
    """
    folder = parts_folder(path)
    if not data.finished and not folder.is_dir():
        raise ResultsFileError(
            _without(path, folder),
            python="move it there, or repeat the ensemble with force=True",
            shell="move it there, or repeat the ensemble with --force",
        )
    numbers = [number for number in part_numbers(path) if number > data.merged]
    for expected, number in enumerate(numbers, data.merged + 1):
        if number != expected:
            raise ResultsFileError(
                f"{_without(path, part_path(path, expected))}; move it there, or {_REMOVE}"
            )
    return [_read_part(part_path(path, number), path, data) for number in numbers]


def _without(path: Path, missing: Path) -> str:
    return f"{path}: is unfinished, and part of it is missing: there is no {missing}"


def _read_part(part: Path, path: Path, data: EnsembleData) -> Part:
    def take(file: StoredFile) -> Part:
        if format_of(file) != PART.format:
            raise ResultsFileError(f"{part}: is not a part of an ensemble; remove it")
        check_layout(part, file, PART)
        if file.attribute(RUN_ID) != data.run_id:
            raise ResultsFileError(
                f"{part}: belongs to another ensemble than {path}",
                python="move the parts of this one there, or repeat the ensemble with force=True",
                shell="move the parts of this one there, or repeat the ensemble with --force",
            )
        known = data.schema.variables
        rows = [name for name, item in known.items() if is_row(item)]
        check_complete(part, file, [NUMBER, STATE, *rows])
        for name in rows:
            stored = file.dataset(name)
            if stored.shape[1:] != data.shapes[name][1:] or stored.dtype != type_of(known[name]):
                raise ValueError(f"{name} has another shape or type than in {path}")
        numbers, status = file.array(NUMBER), file.array("status")
        ascending = numbers.ndim == 1 and numbers.dtype.kind == "i" and np.all(np.diff(numbers) > 0)
        if not ascending or np.any((numbers < 0) | (numbers >= data.requested)):
            raise ValueError("a realisation has an unknown number")
        if len(status) != len(numbers) or np.any(status > FAILED):
            raise ValueError("a realisation has an unknown status")
        state = json.loads(file.text(STATE))
        EnsembleData.check_types(state)
        errors = {int(numbers[row]): text for row, text in _errors_of(file, status).items()}
        return Part(part.absolute(), numbers, status, errors, state)

    try:
        return read_file(part, take)
    except ResultsFileError as error:
        states = ("is truncated", "is damaged", "is empty")
        if not error.message.startswith(tuple(f"{part}: {state}" for state in states)):
            raise
        # without this part and the later ones, the ensemble is as it was before they were written
        remedy = f"copy it again, or remove it and {_REMOVE.removeprefix('remove ')}"
        raise ResultsFileError(f"{error.message}; {remedy}") from error


def _errors_of(file: StoredFile, status: Array) -> dict[int, str]:
    """Return the error messages of failed realisations by their row."""
    errors: dict[int, str] = {}
    failed = np.flatnonzero(status == FAILED)
    for block in np.unique(failed // ERROR_ROWS).tolist():
        first = block * ERROR_ROWS
        texts = file.array("error", (slice(first, first + ERROR_ROWS),))
        chosen = failed[(failed >= first) & (failed < first + ERROR_ROWS)].tolist()
        errors |= {row: text_of(texts[row - first]) for row in chosen}
    return errors


def write_part(
    part: Path, run_id: str, rows: Arrays, state: Mapping[str, Any], storage: Storage
) -> Part:
    """Write a part file, in place of any of this name, and return it.

    Parameters
    ----------
    part : Path
        The file.
    run_id : str
        Identifies the ensemble.
    rows : dict of str to ndarray
        Rows by variable, and the numbers of their realisations; see `blank_rows`.
    state : mapping of str to object
        Fields of `EnsembleData` that changed.
    storage : Storage
        File operations.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    with hdf5_write.new_file(part, storage) as (file, _):
        hdf5_write.put_labels(
            file.id, format=PART.format, format_version=PART.version, **{RUN_ID: run_id}
        )
        for name, array in rows.items():
            hdf5_write.put_array(file, name, array)
        hdf5_write.put_text(file, STATE, json.dumps(state, default=as_plain))
    numbers, status = rows[NUMBER], rows["status"]
    failed = np.flatnonzero(status == FAILED).tolist()
    errors = {int(numbers[place]): text_of(rows["error"][place]) for place in failed}
    return Part(part.absolute(), numbers, status, errors, dict(state))


def text_of(error: np.bytes_) -> str:
    """Return a stored error message."""
    return bytes(error).decode("utf-8", "replace")


def blank_rows(numbers: Sequence[int], data: EnsembleData) -> Arrays:
    """Return rows of pending realisations without values.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of the realisations, ascending.
    data : EnsembleData
        The ensemble.

    Returns
    -------
    dict of str to ndarray
        Numbers, and rows by variable; fewer profiles where not all are kept.
    """
    chosen = np.asarray(numbers, np.int64)
    rows: Arrays = {NUMBER: chosen}
    for name, variable in data.schema.variables.items():
        if is_row(variable):
            length, *row_shape = data.shapes[name]
            empty = np.nan if type_of(variable).kind == "f" else PENDING
            shape = (int(np.searchsorted(chosen, length)), *row_shape)
            rows[name] = np.full(shape, empty if name != "error" else b"", type_of(variable))
    return rows


def rows_of(outcomes: Sequence[Outcome], data: EnsembleData) -> Arrays:
    """Return outcomes as rows, as `blank_rows`.

    Raises
    ------
    ValueError
        If an outcome lacks a value, has an unknown one, or one of another shape.
    """
    outcomes = sorted(outcomes, key=lambda outcome: outcome.number)
    rows = blank_rows([outcome.number for outcome in outcomes], data)
    names = rows.keys() - {NUMBER, "status", "error"}
    for place, outcome in enumerate(outcomes):
        values = outcome.values
        unknown = sorted(values.keys() - names)
        missing = [] if outcome.error else sorted(names - values.keys())
        if place >= len(rows["depth_profile"]):
            missing = [name for name in missing if name not in KEPT]
        if unknown or missing:
            raise ValueError(
                f"realisation {outcome.number}: missing values {missing}, unknown values {unknown}"
            )
        rows["status"][place] = FAILED if outcome.error else DONE
        rows["error"][place] = _stored_text(outcome.error)
        for name, value in values.items():
            row_shape = rows[name].shape[1:]
            if np.shape(value) != row_shape:
                raise ValueError(
                    f"realisation {outcome.number}: {name} has the shape {np.shape(value)},"
                    f" expected {row_shape}"
                )
            rows[name][place : place + 1] = value
    return rows


def joined(before: Arrays, added: Arrays) -> Arrays:
    """Return the rows of both; of equal numbers, the added one."""
    rows = {}
    for name in before:
        keys = np.concatenate([item[NUMBER][: len(item[name])] for item in (before, added)])[::-1]
        _, last = np.unique(keys, return_index=True)
        rows[name] = np.concatenate([before[name], added[name]])[::-1][last]
    return rows


def _stored_text(error: str) -> bytes:
    """Return a text as it is stored, cut between two characters where it is too long."""
    content = error.encode("utf-8", "replace")
    most = ERROR_BYTES - 1
    if len(content) <= most:
        return content
    end = "…".encode()
    return content[: most - len(end)].decode("utf-8", "ignore").encode() + end


def read_ensemble(path: str | Path) -> EnsembleData:
    """Read an ensemble from its file and its parts; arrays are read on access.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    EnsembleData

    Raises
    ------
    ResultsFileError
        If the file or a part is missing, foreign, truncated, damaged, or of another layout.
    """
    try:
        return _read(as_path(path))
    except ResultsFileError:  # its parts may have been merged since the file was opened
        return _read(as_path(path))


def _read(path: Path) -> EnsembleData:
    data, stored = read_file(path, lambda file: _merged(path, file))
    stored.parts += read_parts(path, data)
    status, errors = data.status, data.errors
    for part in stored.parts:
        status[part.numbers] = part.status
        errors |= part.errors
    failed = np.flatnonzero(status == FAILED).tolist()
    changed = {"finished": False, **stored.parts[-1].state} if stored.parts else {}
    return replace(data, errors={number: errors[number] for number in failed}, **changed)


def _merged(path: Path, file: StoredFile) -> tuple[EnsembleData, StoredRows]:
    """Return the content of the file of an ensemble without its parts."""
    attributes = read_attributes(path, file, ENSEMBLE, EnsembleData)
    schema = ensemble_schema(
        attributes["inputs"],
        attributes["control"],
        attributes.get("life", {}),
        attributes.get("cam", False),
        attributes.get("fatigue", False),
    )
    check_complete(path, file, schema.variables)
    datasets = {name: file.dataset(name) for name in schema.variables}
    rows = axis_lengths({n: d.shape for n, d in datasets.items()}, schema.variables)["realisation"]
    if rows != attributes["requested"]:
        raise ValueError(f"{rows} rows for {attributes['requested']} realisations")
    for name, variable in schema.variables.items():
        if datasets[name].dtype != type_of(variable):
            raise ValueError(f"{name} is stored as {datasets[name].dtype}")
    status = file.array("status")
    if (status > FAILED).any():
        raise ValueError(f"a realisation has the status {status.max()}")
    errors = _errors_of(file, status)
    # rows are read on access, perhaps after a change of the working directory
    state = path.absolute(), os.fstat(file.handle)
    stored = StoredRows(
        partial(_read_unchanged, *state),
        schema,
        [],
        small_variables(file, schema.variables),
        partial(_is_unchanged, *state),
    )
    return EnsembleData(**attributes, variables=stored, status=status, errors=errors), stored


def _read_unchanged(
    path: Path, identity: os.stat_result, take: Callable[[StoredFile], Arrays]
) -> Arrays:
    """Apply `take` to a file after checking that it has not been replaced."""

    def checked(file: StoredFile) -> Arrays:
        if not os.path.samestat(os.fstat(file.handle), identity):
            raise ResultsFileError(f"{path}: was replaced by another; open it again")
        return take(file)

    return read_file(path, checked)


def _is_unchanged(path: Path, identity: os.stat_result) -> bool:
    """Return whether a file is the same one, and was not written since."""
    try:
        now = path.stat()
    except OSError:
        return False
    ours, theirs = ((state.st_size, state.st_mtime_ns) for state in (now, identity))
    return os.path.samestat(now, identity) and ours == theirs
