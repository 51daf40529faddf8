"""Many files into the store at once, with two flushes for all of them instead of five for each.

What `Storage.put` promises holds here too: once `settle` returns, the files are there as a whole,
also after a power cut. Each is written as a draft as soon as it is known, so that its bytes need
not be held until the last one has come. All drafts are flushed together, then moved to their
places, then the folders are flushed: a file is never at its place before its bytes are on the disk.
"""

import ctypes
import errno
import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from app.errors import StorageFull
from app.storage import Storage

FEW = 4  # so many files are flushed faster one by one
DRAFT = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
FULL = frozenset({errno.ENOSPC, errno.EDQUOT})


class StoringTogether:
    """Files on their way into the store; leaving it unsettled takes them back."""

    def __init__(self, storage: Storage) -> None:
        self._storage = storage
        self._root = storage.root
        self._token = secrets.token_hex(8)
        # Plain names: thousands of path objects cost more than what is done with them.
        self._drafts: dict[str, str] = {}
        self._found: set[str] = set()

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Remove the drafts that were not settled."""
        for draft in self._drafts.values():
            with suppress(FileNotFoundError):
                os.unlink(draft)

    def add(self, sha256: str, data: bytes) -> None:
        """Take bytes by their SHA-256 (hex), which the caller has computed.

        Raises StorageFull when the disk is full.
        """
        path = self._storage.local_path(sha256)
        if path is None:
            self._storage.put(data)
            return
        place = str(path)
        if place in self._drafts or place in self._found:
            return
        if _touched(place):
            self._found.add(place)
            return
        draft = f"{place.removesuffix(sha256)}.{sha256}.{self._token}"
        self._drafts[place] = draft
        with _full_told():
            _write(draft, data)

    def settle(self) -> None:
        """Flush all that was added, and move it to its places. Raises StorageFull."""
        places = {*self._drafts, *self._found}
        are_few = len(places) <= FEW
        with _full_told():
            if are_few:
                _flush_each(self._drafts.values())
            elif self._drafts:
                _flush_all(self._root)
            for place, draft in self._drafts.items():
                os.replace(draft, place)
            self._drafts.clear()
            # Those found there may be another writer's, whose flush has not come yet.
            if are_few:
                _flush_each(self._folders(places))
            else:
                _flush_all(self._root)

    def _folders(self, places: Iterable[str]) -> list[str]:
        """Return the folders of files up to the one that holds the store, those below first."""
        root = Path(self._root)
        above = {root.parent} | {
            folder
            for place in places
            for folder in Path(place).parents
            if folder.is_relative_to(root)
        }
        return [str(folder) for folder in sorted(above, key=lambda each: -len(each.parts))]


@contextmanager
def _full_told() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise StorageFull("there is no room left; free some space and try again") from error
        raise


def _touched(path: str) -> bool:
    """Whether a file is there; if so, it is now too young to be swept away as unused."""
    try:
        os.utime(path)
    except FileNotFoundError:
        return False
    return True


def _write(draft: str, data: bytes) -> None:
    try:
        descriptor = os.open(draft, DRAFT)
    except FileNotFoundError:
        os.makedirs(os.path.dirname(draft), exist_ok=True)
        descriptor = os.open(draft, DRAFT)
    try:
        rest = memoryview(data)
        while rest:  # the system may take a part only
            rest = rest[os.write(descriptor, rest) :]
    finally:
        os.close(descriptor)


def _flush_each(paths: Iterable[str]) -> None:
    for path in paths:
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _flush_all(root: str) -> None:
    """Flush the file system of a folder (Linux), or all of them where that cannot be asked for."""
    try:
        flush = ctypes.CDLL(None, use_errno=True).syncfs
    except AttributeError:
        os.sync()
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        if flush(descriptor) != 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code), root)
    finally:
        os.close(descriptor)
