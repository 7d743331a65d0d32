"""Writing of an ensemble: part files while it is computed, which are merged at the end."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from wearsim.atomic_write import (
    DISK,
    TEMPORARY,
    Storage,
    acquire_lock,
    os_errors_converted,
    parts_folder,
    release_lock,
)
from wearsim.results.content import Array, Arrays
from wearsim.results.io.stored_file import StoredFile
from wearsim.studies.ensemble.file.data import EnsembleData, Outcome, StoredRows
from wearsim.studies.ensemble.file.parts import (
    NUMBER,
    blank_rows,
    joined,
    part_numbers,
    part_path,
    read_ensemble,
    rows_of,
    write_part,
)
from wearsim.studies.ensemble.file.schema import (
    ANGLE,
    ENSEMBLE,
    PENDING,
    QUANTILES,
    STATIC,
    is_row,
)

if TYPE_CHECKING:
    import h5py

#: Size of a part file, beyond which rows go to the next one.
PART_BYTES = 1 << 21
_BLOCK_BYTES = 1 << 26  # size of the variables for which each part is opened once

Completion: TypeAlias = Callable[[EnsembleData], tuple[Mapping[str, Any], Arrays]]


@contextmanager
def _locked(path: Path) -> Iterator[IO[bytes]]:
    """Acquire the lock of an ensemble, and release it if an exception ends the with statement."""
    lock = acquire_lock(path)
    try:
        yield lock
    except BaseException:
        release_lock(lock, path)
        raise


class EnsembleFile(AbstractContextManager["EnsembleFile"]):
    """An ensemble open for writing by this process alone.

    Rows are written to part files, of which the last is written again as a whole whenever
    realisations finish, until it is large enough. `finish` merges them into the file of the
    ensemble. What is stored depends neither on the order of the realisations nor on batches.

    Every call may raise a ResultsFileError that names the file, for example when the disk is full.
    What was stored before is then unchanged, and the call can be repeated.
    """

    def __init__(self, path: Path, storage: Storage, lock: IO[bytes]) -> None:
        self.path = path
        self._storage, self._lock = storage, lock
        self._load()

    def _load(self) -> None:
        """Read the ensemble, and delete parts that are merged or left by another ensemble."""
        #: The content of the file and the parts when they were read.
        self.data = read_ensemble(self.path)
        self._stored = cast("StoredRows", self.data.variables)
        self._status = self.data.status.copy()
        parts = self._stored.parts
        self._state: dict[str, Any] = parts[-1].state if parts else {}
        self._start_part(self.data.merged + len(parts) + 1)
        with os_errors_converted(self.path):
            for number in part_numbers(self.path):
                if number <= self.data.merged:
                    self._storage.remove(part_path(self.path, number))
            for remains in parts_folder(self.path).glob(f"*{TEMPORARY}"):  # of a killed process
                self._storage.remove(remains)

    def _start_part(self, number: int) -> None:
        self._number, self._rows = number, blank_rows([], self.data)
        self._closed = len(self._stored.parts)

    @classmethod
    def create(
        cls,
        path: str | Path,
        header: EnsembleData,
        static: Mapping[str, Array],
        storage: Storage = DISK,
    ) -> EnsembleFile:
        """Write a file in which all realisations are pending, replacing any, and open it.

        Parameters
        ----------
        path : str or Path
            The file.
        header : EnsembleData
            What is known before the first realisation; its variables, status and errors are
            ignored.
        static : mapping of str to ndarray
            The variables `schema.STATIC`, and the angles of a cam.
        storage : Storage
            File operations.

        Raises
        ------
        ResultsFileError
            If it cannot be written, or if another process is writing one with this name.
        ValueError
            If static arrays are missing, unknown, or inconsistent.
        """
        from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

        names = STATIC.keys() | ({ANGLE.name} & header.schema.variables.keys())
        if static.keys() != names:
            raise ValueError(f"static arrays are {sorted(names)}, got {sorted(static)}")
        path = Path(path)
        folder = parts_folder(path)
        known = {
            **{name: np.asarray(array, float) for name, array in static.items()},
            "quantile": np.array(QUANTILES),
        }
        with _locked(path) as lock:
            is_new = not folder.exists()
            # the parts of an ensemble that is replaced count as merged, and are deleted later
            last = max(part_numbers(path), default=0)
            header = replace(header, variables=known, run_id=uuid.uuid4().hex, merged=last)
            with os_errors_converted(path):
                folder.mkdir(exist_ok=True)  # before the file, which is incomplete without it
            try:
                with hdf5_write.new_file(path, storage) as (file, _):
                    hdf5_write.put_variables(file, header.schema, known, header.reserved)
                    hdf5_write.put_texts(file, ENSEMBLE, header)
            except BaseException:
                if is_new:
                    folder.rmdir()
                raise
            return cls(path, storage, lock)

    @classmethod
    def open(cls, path: str | Path, storage: Storage = DISK) -> EnsembleFile:
        """Open an ensemble to continue it.

        Parameters
        ----------
        path : str or Path
            The file.
        storage : Storage
            File operations.

        Raises
        ------
        ResultsFileError
            If it cannot be read, cannot be written, or is being written by another process.
        """
        path = Path(path)
        read_ensemble(path)  # refused before a folder is made
        with _locked(path) as lock:
            with os_errors_converted(path):
                parts_folder(path).mkdir(exist_ok=True)
            return cls(path, storage, lock)  # as another writer left it

    @property
    def status(self) -> Array:
        """PENDING, DONE or FAILED of every realisation, shape (requested,), read-only."""
        view = self._status.view()
        view.flags.writeable = False
        return view

    def put(self, outcomes: Sequence[Outcome]) -> None:
        """Store some realisations; they are on the disk when this returns.

        Parameters
        ----------
        outcomes : sequence of Outcome
            Pending realisations, in any order.

        Raises
        ------
        ValueError
            If one is not pending, or if its values differ from the schema. Nothing is
            written then.
        """
        numbers = [outcome.number for outcome in outcomes]
        taken = [number for number in numbers if self._status_of(number) != PENDING]
        if taken or len(set(numbers)) < len(numbers):
            raise ValueError(f"realisations {taken or 'twice in a batch'} are there already")
        self._add(rows_of(outcomes, self.data))

    def clear(self, numbers: Iterable[int]) -> None:
        """Make realisations pending again, so that they can be stored once more.

        Parameters
        ----------
        numbers : iterable of int
            The realisations.
        """
        chosen = sorted(set(numbers))
        for number in chosen:
            self._status_of(number)
        self._add(blank_rows(chosen, self.data))

    def put_state(self, **state: Any) -> None:
        """Store fields of `EnsembleData` that have changed, such as `wall_seconds`.

        Raises
        ------
        ValueError
            If there is no such field, or if it is stored separately.
        """
        if unknown := state.keys() - set(EnsembleData.attribute_names()):
            raise ValueError(f"an ensemble has no fields {sorted(unknown)}")
        self._add(blank_rows([], self.data), state)

    def grow(self, requested: int, **state: Any) -> None:
        """Add pending realisations; the ensemble is then unfinished.

        Parameters
        ----------
        requested : int
            New number of realisations, larger than before.
        state
            Fields that change with it, as for `put_state`.
        """
        self._state = {**self._state, **state}
        self._merge(replace(self.data, requested=requested, finished=False, statistics={}))

    def finish(self, complete: Completion) -> None:
        """Merge all parts into the file of the ensemble, and delete them.

        Parameters
        ----------
        complete : callable
            Function of the merged `EnsembleData`, which returns the fields that change, such as
            `finished`, and the variables `schema.STATISTICS`.
        """
        self._merge(self.data, complete)

    def close(self) -> None:
        """Release the ensemble; the folder of its parts is removed if it is finished."""
        if self._lock.closed:
            return
        if self.data.finished and not self._stored.parts:
            with suppress(OSError):  # files of others are left there
                parts_folder(self.path).rmdir()
        release_lock(self._lock, self.path)

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

    def _add(self, rows: Arrays, state: Mapping[str, Any] | None = None) -> None:
        """Write the last part with further rows and changed fields."""
        joint, changed = joined(self._rows, rows), {**self._state, **(state or {})}
        part = write_part(
            part_path(self.path, self._number), self.data.run_id, joint, changed, self._storage
        )
        self._stored.parts[self._closed :] = [part]
        self._status[rows[NUMBER]] = rows["status"]
        self._rows, self._state = joint, changed
        if sum(array.nbytes for array in joint.values()) >= PART_BYTES:
            self._start_part(self._number + 1)

    def _merge(self, header: EnsembleData, complete: Completion | None = None) -> None:
        """Replace the file by one that contains the rows of all parts."""
        from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

        known = {
            name: self._stored[name]
            for name, variable in self.data.schema.variables.items()
            if variable.kind == "static"
        }
        header = replace(header, **self._state, variables=known, merged=self._number)
        with hdf5_write.new_file(self.path, self._storage) as (file, check):
            hdf5_write.put_variables(file, header.schema, known, header.reserved)
            for start in range(0, len(self._status), hdf5_write.CHUNK_ROWS):
                self._copy_rows(file, start, start + hdf5_write.CHUNK_ROWS)
                check()
            if complete is not None:
                rows = StoredRows(lambda take: take(StoredFile(file)), header.schema, [])
                fields, statistics = complete(
                    replace(header, variables=rows, status=self._status.copy())
                )
                for name, array in statistics.items():
                    if header.schema.variables[name].kind != "statistic":
                        raise ValueError(f"{name} is not a statistic of an ensemble")
                    if np.shape(array) != (shape := file[name].shape):
                        raise ValueError(
                            f"{name} has the shape {np.shape(array)}, expected {shape}"
                        )
                    hdf5_write.put_rows(file[name], 0, array)
                header = replace(header, **fields)
            hdf5_write.put_texts(file, ENSEMBLE, header)
        self._load()

    def _copy_rows(self, file: h5py.File, start: int, stop: int) -> None:
        from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

        if (self._status[start:stop] == PENDING).all():
            return
        variables, reserved = self.data.schema.variables, self.data.reserved
        names = [name for name, variable in variables.items() if is_row(variable)]
        blocks = np.cumsum([reserved[name][start:stop].nbytes for name in names]) // _BLOCK_BYTES
        for number in np.unique(blocks):
            block = [name for name, of in zip(names, blocks, strict=True) if of == number]
            for name, rows in self._stored.block(block, start, stop).items():
                if len(rows) and (name != "error" or np.any(rows != b"")):
                    hdf5_write.put_rows(file[name], start, rows)
