"""An open results file, of which numbers and texts are read and nothing else.

A file may come from anyone. HDF5 can hold links to other files, arrays that are stored in other
files, compressed arrays that become a thousand times as long in memory, and arrays of any size of
which nothing is stored. Files of wearsim hold none of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wearsim.results.content import ERRORS, ZEROS, Array, only_zeros

if TYPE_CHECKING:
    import h5py

#: Memory that arrays may take beyond the size of the file [bytes]: rows that are not yet written.
SPARE = 1 << 28
_LONGEST = 1 << 16  # bytes of an attribute
_ZEROED = "{} has a block of zeros, which was not written"


class StoredArray(NamedTuple):
    """An open dataset of HDF5, with its shape, type and chunk shape.

    An `h5py.Dataset` reads these from the file at each access.
    """

    id: Any
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    chunks: tuple[int, ...] | None

    @property
    def nbytes(self) -> int:
        """Size of the array [bytes]."""
        return math.prod(self.shape) * self.dtype.itemsize

    def read(self) -> Array:
        """Read the whole array."""
        from h5py import h5s  # noqa: PLC0415  (takes 0.2 s to import)

        values = np.empty(self.shape, self.dtype)
        self.id.read(h5s.ALL, h5s.ALL, values)
        return values


class StoredFile:
    """An open results file.

    All that is read from it takes at most `SPARE` bytes more than the file.

    Parameters
    ----------
    file : h5py.File
        The file, open.
    """

    def __init__(self, file: h5py.File) -> None:
        self._file = file
        self._size: int = file.id.get_filesize()
        self._read = 0  # [bytes]
        self._folders: dict[tuple[bytes, ...], Any] = {}
        self._checked: dict[str, StoredArray] = {}  # those that have not been read yet

    @property
    def handle(self) -> int:
        """Number of the open file of the operating system."""
        return int(self._file.id.get_vfd_handle())

    def attribute(self, name: str) -> Any:
        """Return an attribute of the file, a number or a short text.

        Raises
        ------
        KeyError
            If there is none.
        ValueError
            If it is neither a number nor a text of fixed length.
        """
        from h5py import h5a  # noqa: PLC0415  (takes 0.2 s to import)

        if not h5a.exists(self._file.id, name.encode()):
            raise KeyError(f"lacks the attribute {name}")
        attribute = h5a.open(self._file.id, name.encode())
        if not (
            attribute.shape == ()
            and _is_plain(attribute.get_type())
            and attribute.get_storage_size() <= _LONGEST
        ):
            raise ValueError(f"the attribute {name} is neither a number nor a short text")
        value = self._file.attrs[name]
        return value.decode("utf-8", ERRORS) if isinstance(value, bytes) else value

    def __contains__(self, name: object) -> bool:
        try:
            folder, last = self._folder(str(name))
        except (KeyError, ValueError):
            return False
        return bool(folder.links.exists(last))

    def names(self, folder: str) -> list[str]:
        """Return the names in a folder of the file."""
        return [name.decode("utf-8", ERRORS) for name in self._folder(f"{folder}/*")[0]]

    def dataset(self, name: str) -> StoredArray:
        """Return a stored array, of which shape and type are known and nothing is read.

        Raises
        ------
        KeyError
            If there is none.
        ValueError
            If it is in another place or another file, compressed, or holds neither numbers nor
            texts of fixed length.
        """
        from h5py import h5d, h5z  # noqa: PLC0415  (takes 0.2 s to import)

        if name in self._checked:
            return self._checked[name]
        folder, last = self._folder(name)
        _check_link(folder, last, name)
        stored = h5d.open(folder, last)
        made, kind = stored.get_create_plist(), stored.get_type()
        filters = {made.get_filter(number)[0] for number in range(made.get_nfilters())}
        elsewhere = (layout := made.get_layout()) == h5d.VIRTUAL or made.get_external_count()
        mistakes = {
            "is stored in another file": elsewhere,
            "is compressed or changed by a filter": filters - {h5z.FILTER_FLETCHER32},
            "holds neither numbers nor texts of fixed length": not _is_plain(kind),
        }
        for what, found in mistakes.items():
            if found:
                raise ValueError(f"{name} {what}")
        chunks = made.get_chunk() if layout == h5d.CHUNKED else None
        self._checked[name] = StoredArray(stored, stored.shape, kind.dtype, chunks)
        return self._checked[name]

    def array(self, name: str, chosen: tuple[slice, ...] | int = ()) -> Array:
        """Read an array.

        Parameters
        ----------
        name : str
            Its path in the file.
        chosen : tuple of slice or int
            The entries along each axis, by default all; or one entry.

        Raises
        ------
        KeyError
            If there is none.
        ValueError
            As `dataset`; or if it is too long.
        """
        import h5py  # noqa: PLC0415  (takes 0.2 s to import)

        stored = self.dataset(name)
        del self._checked[name]  # an open array keeps what was read in a buffer
        chosen = (slice(chosen, chosen + 1),) if isinstance(chosen, int) else chosen
        shape, chunks = stored.shape, stored.chunks
        lengths = [
            len(range(*part.indices(length))) for part, length in zip(chosen, shape, strict=False)
        ]
        numbers = math.prod([*lengths, *shape[len(lengths) :]])
        # a chunk is read as a whole
        least = math.prod(chunks) if chunks and numbers else 0
        self._claim(name, max(numbers, least) * stored.dtype.itemsize, SPARE)
        values = np.asarray(h5py.Dataset(stored.id)[chosen]) if chosen else stored.read()
        if chunks and numbers and not h5py.h5a.exists(stored.id, ZEROS.encode()):
            _check_zeros(name, stored, chosen, values)
        return values

    def text(self, name: str) -> str:
        """Read a text written by `hdf5_write.put_text`.

        Raises
        ------
        KeyError
            If there is none.
        ValueError
            As `dataset`; or if it is longer than the file.
        """
        stored = self.dataset(name)
        if stored.shape != (1,) or stored.dtype.kind != "S":
            raise ValueError(f"{name} is no text")
        self._claim(name, stored.dtype.itemsize, 0)
        content: bytes = stored.read().tobytes()  # a single element would lose zeros at its end
        if len(content) > 1 and not content.strip(b"\0"):
            raise ValueError(_ZEROED.format(name))
        return content[:-1].decode("utf-8", ERRORS)

    def _claim(self, name: str, size: int, spare: int) -> None:
        """Raise a ValueError if what is read becomes longer than the file and some spare memory."""
        self._read += size
        if max(size, self._read - SPARE) > self._size + spare:
            raise ValueError(
                f"{name} is given as {size:.3g} bytes, and the file has {self._size:.3g}"
            )

    def _folder(self, name: str) -> tuple[Any, bytes]:
        """Return the folder of an object in the file, and the last part of its name."""
        import h5py  # noqa: PLC0415  (takes 0.2 s to import)

        *parents, last = name.encode("utf-8", ERRORS).split(b"/")
        folder = self._file.id  # of the root
        if parents and (path := tuple(parents)) in self._folders:
            return self._folders[path], last
        for parent in parents:
            _check_link(folder, parent, name)
            folder = h5py.h5g.open(folder, parent)
        self._folders[tuple(parents)] = folder
        return folder, last


def _check_link(folder: Any, last: bytes, name: str) -> None:
    """Raise an error unless a name in a folder leads to an object in the file itself."""
    import h5py  # noqa: PLC0415  (takes 0.2 s to import)

    if not folder.links.exists(last):
        raise KeyError(f"lacks {name}")
    if folder.links.get_info(last).type != h5py.h5l.TYPE_HARD:
        raise ValueError(f"{name} is a link to another place")


def _check_zeros(name: str, stored: StoredArray, chosen: tuple[slice, ...], values: Array) -> None:
    """Raise a ValueError if a stored chunk of an array that should have none has zeros only."""
    import h5py  # noqa: PLC0415  (takes 0.2 s to import)

    shape, lengths = stored.shape, stored.chunks or stored.shape
    region = [slice(*part.indices(length)) for part, length in zip(chosen, shape, strict=False)]
    region += [slice(0, length) for length in shape[len(region) :]]
    if lengths == shape == values.shape and not only_zeros(values):
        return  # a single chunk
    dataset = h5py.Dataset(stored.id)
    starts = [part.start for part in region]
    for block in dataset.iter_chunks(tuple(region)):
        part = tuple(slice(b.start - s, b.stop - s) for b, s in zip(block, starts, strict=True))
        if not only_zeros(values[part]):
            continue
        corner = tuple(b.start // length * length for b, length in zip(block, lengths, strict=True))
        if dataset.id.get_chunk_info_by_coord(corner).byte_offset is None:
            continue  # rows that are not yet written
        chunk = tuple(slice(c, c + length) for c, length in zip(corner, lengths, strict=True))
        if only_zeros(dataset[chunk]):
            raise ValueError(_ZEROED.format(name))


def _is_plain(kind: Any) -> bool:
    """Return whether a type of HDF5 holds numbers or texts of fixed length."""
    from h5py import h5t  # noqa: PLC0415  (takes 0.2 s to import)

    of_text = kind.get_class() == h5t.STRING and not kind.is_variable_str()
    return of_text or kind.get_class() in {h5t.INTEGER, h5t.FLOAT, h5t.ENUM}
