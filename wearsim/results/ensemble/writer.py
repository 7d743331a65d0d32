"""A file that is written in place, by one process alone."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from wearsim.errors import ResultsFileError
from wearsim.results.ensemble import state_slots
from wearsim.results.ensemble.data import EnsembleData, Outcome
from wearsim.results.ensemble.reader import EnsembleFileParts, read_parts
from wearsim.results.ensemble.row_encoding import Rows, rows_of, runs
from wearsim.results.ensemble.schema import PENDING, STATIC, STATISTICS
from wearsim.results.io.atomic_write import os_errors_converted, stage, write_chunks, write_pieces
from wearsim.results.io.file_lock import lock_or_refuse, refuse_if_locked
from wearsim.results.io.reader import kind_of


class FileInPlace:
    """A file open for writing in place, which nobody else can write meanwhile.

    Every call may raise a ResultsFileError that names the file: when the disk is full, say.

    Parameters
    ----------
    path : Path
        The file, which must be there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with os_errors_converted(path):
            self._file = path.open("r+b", buffering=0)
        try:
            lock_or_refuse(self._file, path)
        except BaseException:
            self._file.close()
            raise

    def read(self, offset: int, count: int) -> bytes:
        """Return bytes of the file.

        Parameters
        ----------
        offset, count : int
            Bytes before the first, and how many.
        """
        try:
            self._file.seek(offset)
            return self._file.read(count)
        except OSError as error:
            raise ResultsFileError(f"{self._path}: cannot be read ({error.strerror})") from error

    def write(self, offset: int, content: bytes) -> None:
        """Write bytes over those that stand there.

        Parameters
        ----------
        offset : int
            Bytes before the first.
        content : bytes
            What to write.
        """
        with os_errors_converted(self._path):
            self._file.seek(offset)
            write_chunks(self._file, content)

    def synchronise(self) -> None:
        """Wait until all that was written is on the disk."""
        with os_errors_converted(self._path), stage("fsync"):
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let go of the file, all of it on the disk."""
        if self._file.closed:
            return
        try:
            self.synchronise()
        finally:
            self._file.close()


class EnsembleFile:
    """An ensemble's file open for writing, which nobody else can write meanwhile.

    What it writes depends neither on the order of the realisations nor on how they are batched.
    Every call may raise a ResultsFileError that names the file: when the disk is full, say.
    """

    def __init__(self, path: Path, file: FileInPlace, parts: EnsembleFileParts) -> None:
        self.path = path
        self.data = parts.data
        """What the file held when it was opened."""
        self._file = file
        self._extents = parts.extents
        self._status = parts.data.status.copy()
        self._state = parts.data.state
        self._writing = parts.state_number

    @classmethod
    def create(
        cls,
        path: str | Path,
        header: EnsembleData,
        static: Mapping[str, npt.NDArray[Any]],
    ) -> EnsembleFile:
        """Write a file in which all realisations are pending, in place of any, and open it.

        Parameters
        ----------
        path : str or Path
            The file.
        header : EnsembleData
            What is known before the first realisation; its variables, status and errors are not
            looked at.
        static : mapping of str to ndarray
            Those of `ensemble_layout.STATIC`.

        Raises
        ------
        ResultsFileError
            If it cannot be written, or if another process is writing one that stands there.
        ValueError
            If static arrays are missing, unknown, or do not fit together.
        """
        from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

        if static.keys() != STATIC.keys():
            raise ValueError(f"static arrays are {sorted(STATIC)}, got {sorted(static)}")
        image = hdf5_write.sparse_image(replace(header, variables=static).content)
        refuse_if_locked(path)
        write_pieces(path, image.pieces(), image.size)
        return cls.open(path)

    @classmethod
    def open(cls, path: str | Path) -> EnsembleFile:
        """Open a file to go on with it.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        ResultsFileError
            If it is not a sound file of an ensemble, cannot be written, or is being written by
            another process.
        """
        path = Path(path)
        kind_of(path)  # where there is none, or no HDF5, that is said first
        file = FileInPlace(path)
        try:
            return cls(path, file, read_parts(path))  # as another writer left it
        except BaseException:
            file.close()
            raise

    @property
    def status(self) -> npt.NDArray[np.uint8]:
        """PENDING, DONE or FAILED of every realisation, shape (asked,), not to be changed."""
        view = self._status.view()
        view.flags.writeable = False
        return view

    def put(self, outcomes: Sequence[Outcome]) -> None:
        """Write some realisations; once this returns they are in the file for good.

        Parameters
        ----------
        outcomes : sequence of Outcome
            Pending realisations, in any order.

        Raises
        ------
        ValueError
            If one is not pending, or if its numbers are not those of the schema. Nothing is
            written then.
        """
        taken = [item.number for item in outcomes if self._status_of(item.number) != PENDING]
        if taken or len({item.number for item in outcomes}) < len(outcomes):
            raise ValueError(f"realisations {taken or 'twice in a batch'} are there already")
        schema = self.data.schema
        batch = [rows_of(run, schema, self._extents) for run in runs(outcomes)]
        for rows in batch:
            self._put_rows(rows)
        self._file.synchronise()
        for rows in batch:
            self._put_status(rows.first, rows.status)

    def clear(self, numbers: Iterable[int]) -> None:
        """Make realisations pending again, so that they can be put anew.

        Parameters
        ----------
        numbers : iterable of int
            Those to clear.
        """
        chosen = np.unique(np.fromiter(numbers, np.int64))
        for number in chosen.tolist():
            self._status_of(number)
        for run in np.split(chosen, np.flatnonzero(np.diff(chosen) > 1) + 1):
            if run.size:
                self._put_status(int(run[0]), np.full(run.size, PENDING, np.uint8))
        self._file.synchronise()  # before anything is written over their rows

    def put_state(self, state: Mapping[str, Any]) -> None:
        """Write what has changed; a kill meanwhile leaves the state before it.

        Parameters
        ----------
        state : mapping
            Any of `state_slots.NAMES`; what it leaves out stays as it is.

        Raises
        ------
        ValueError
            If it holds other names, or is too long.
        """
        changed = {**self._state, **state}
        number = self._writing + 1
        content = state_slots.written(number, changed)
        place = self._extents[state_slots.place_of(number)]
        self._file.synchronise()  # what it tells of is on the disk before it
        self._file.write(place.offset, content)
        self._file.synchronise()  # before the other place is written over
        self._state, self._writing = changed, number

    def put_statistics(self, statistics: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write estimates for readers of the file.

        Parameters
        ----------
        statistics : mapping of str to ndarray
            Any of `ensemble_layout.STATISTICS`.

        Raises
        ------
        ValueError
            If one is unknown or does not fit.
        """
        found = {name: np.asarray(array, "<f8") for name, array in statistics.items()}
        for name, array in found.items():
            if name not in STATISTICS:
                raise ValueError(f"{name} is not a statistic of an ensemble")
            if array.shape != self._extents[name].shape:
                raise ValueError(
                    f"{name} has the shape {array.shape}, expected {self._extents[name].shape}"
                )
        for name, array in found.items():
            self._file.write(self._extents[name].offset, array.tobytes())

    def close(self) -> None:
        """Let go of the file, all of it on the disk."""
        self._file.close()

    def __enter__(self) -> EnsembleFile:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _status_of(self, number: int) -> int:
        if not 0 <= number < len(self._status):
            raise ValueError(f"there is no realisation {number} in {len(self._status)}")
        return int(self._status[number])

    def _put_rows(self, rows: Rows) -> None:
        for name, array in rows.arrays.items():
            if len(array):
                self._file.write(self._extents[name].at(rows.first), array.tobytes())
        # a text of an earlier failure may stand there; where there is none it stays a hole
        error = self._extents["error"]
        errors = rows.errors.astype(error.dtype).tobytes()
        nothing, offset = bytes(len(errors)), error.at(rows.first)
        if errors != nothing or self._file.read(offset, len(errors)) != nothing:
            self._file.write(offset, errors)

    def _put_status(self, first: int, status: npt.NDArray[np.uint8]) -> None:
        self._file.write(self._extents["status"].at(first), status.tobytes())
        self._status[first : first + len(status)] = status
