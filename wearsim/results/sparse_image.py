"""The image of a file that is mostly holes, in memory."""

from __future__ import annotations

import io
from collections.abc import Iterator

_PAGE = 1 << 16


class SparseImage:
    """What is written to a file, holes left out, with the calls that HDF5 makes of a file.

    The disk is then written by our own calls, which fail as writing does: HDF5 itself is left in
    disorder by a disk that is full.
    """

    def __init__(self) -> None:
        self._pages: dict[int, bytearray] = {}
        self._place = 0
        self.size = 0
        """Bytes of the file, holes included."""

    def pieces(self) -> Iterator[tuple[int, bytes]]:
        """Yield what was written, and how many bytes stand before it."""
        for number in sorted(self._pages):
            start = number * _PAGE
            yield start, bytes(self._pages[number][: self.size - start])

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place, as files do."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self.size}[whence]
        self._place = start + offset
        return self._place

    def tell(self) -> int:
        """Return the place, as files do."""
        return self._place

    def truncate(self, size: int) -> int:
        """Set the size, as files do; only the last is cut off."""
        self.size = size
        return size

    def flush(self) -> None:
        """Do nothing: there is no disk."""

    def write(self, content: bytes | memoryview) -> int:
        """Write at the place, as files do."""
        view = memoryview(content).cast("B")
        for page, inside, done in self._spans(len(view)):
            piece = view[done : done + _PAGE - inside]
            self._pages.setdefault(page, bytearray(_PAGE))[inside : inside + len(piece)] = piece
        self._place += len(view)
        self.size = max(self.size, self._place)
        return len(view)

    def readinto(self, target: memoryview) -> int:
        """Read at the place, as files do."""
        view = memoryview(target).cast("B")
        for page, inside, done in self._spans(len(view)):
            piece = self._pages.get(page, bytes(_PAGE))[inside : inside + len(view) - done]
            view[done : done + len(piece)] = piece
        self._place += len(view)
        return len(view)

    def _spans(self, count: int) -> Iterator[tuple[int, int, int]]:
        """Yield the pages of the bytes at the place: which, where in it, how many before."""
        done = 0
        while done < count:
            page, inside = divmod(self._place + done, _PAGE)
            yield page, inside, done
            done += _PAGE - inside
