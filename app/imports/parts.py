"""Large files that come in pieces: each piece is kept under its offset until the last has come.

Pieces lie beside the content-addressed files, under names of our own. A file that is whole is read
through one stream over all of its pieces, so that no second copy of a large archive is needed.
"""

import bisect
import io
import os
from typing import IO, TYPE_CHECKING, Any, cast

import fsspec

from app.errors import NotFound, StorageFull
from app.storing_together import FULL

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer


class Parts:
    """The pieces of unfinished files below the file store's folder or URL."""

    def __init__(self, storage_url: str) -> None:
        self._filesystem: Any
        self._filesystem, root = fsspec.core.url_to_fs(storage_url)
        self._root = f"{root}/parts"
        self._is_local = "file" in self._filesystem.protocol

    def put(self, import_id: int, file_id: int, offset: int, data: bytes) -> None:
        """Keep a piece; the same offset again replaces it. Raises StorageFull."""
        path = f"{self._folder(import_id, file_id)}/{offset:015}"
        self._filesystem.makedirs(path.rpartition("/")[0], exist_ok=True)
        try:
            with self._filesystem.open(path, "wb") as target:
                target.write(data)
                if self._is_local:
                    target.flush()
                    os.fsync(target.fileno())
        except OSError as error:
            if error.errno in FULL:
                raise StorageFull("there is no room left; free some space and try again") from error
            raise

    def open(self, import_id: int, file_id: int, size_bytes: int) -> IO[bytes]:
        """Open a whole file as one seekable stream. Raises NotFound when a piece is missing."""
        folder = self._folder(import_id, file_id)
        found = sorted(str(path) for path in self._filesystem.find(folder))
        sizes = [int(self._filesystem.size(path)) for path in found]
        starts = [int(path.rpartition("/")[2]) for path in found]
        ends = [start + size for start, size in zip(starts, sizes, strict=True)]
        if [*starts, size_bytes] != [0, *ends]:
            raise NotFound("pieces of the file are gone from the store; send it again")
        return cast(
            "IO[bytes]", io.BufferedReader(_Joined(self._filesystem, found, starts, size_bytes))
        )

    def remove(self, import_id: int, file_id: int | None = None) -> None:
        """Remove the pieces of a file, or of a whole batch."""
        folder = self._folder(import_id, file_id)
        if self._filesystem.exists(folder):
            self._filesystem.rm(folder, recursive=True)

    def _folder(self, import_id: int, file_id: int | None) -> str:
        batch = f"{self._root}/{import_id}"
        return batch if file_id is None else f"{batch}/{file_id}"


class _Joined(io.RawIOBase):
    """Pieces read as one file."""

    def __init__(
        self,
        filesystem: Any,  # noqa: ANN401  fsspec is not typed
        paths: list[str],
        starts: list[int],
        size_bytes: int,
    ) -> None:
        super().__init__()
        self._filesystem = filesystem
        self._paths = paths
        self._starts = starts
        self._size_bytes = size_bytes
        self._at = 0
        self._open: tuple[int, IO[bytes]] | None = None

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size_bytes}[whence]
        if base + offset < 0:
            raise ValueError("a place before the beginning")
        self._at = base + offset
        return self._at

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        if self._at >= self._size_bytes:
            return 0
        target = memoryview(buffer)
        number = bisect.bisect_right(self._starts, self._at) - 1
        stream = self._piece(number)
        stream.seek(self._at - self._starts[number])
        data = stream.read(len(target))
        target[: len(data)] = data
        self._at += len(data)
        return len(data)

    def _piece(self, number: int) -> IO[bytes]:
        if self._open is None or self._open[0] != number:
            self._let_go()
            self._open = (number, self._filesystem.open(self._paths[number], "rb"))
        return self._open[1]

    def _let_go(self) -> None:
        if self._open is not None:
            self._open[1].close()
            self._open = None

    def close(self) -> None:
        self._let_go()
        super().close()
