"""The file store: bytes under their SHA-256, in a folder or a bucket.

A file is written beside its place, flushed to the disk and moved there before any row speaks of
it; so a row never points at bytes that a power cut took away. The same bytes are stored once.
Derived files (previews) have names of their own and may be thrown away at any time.
"""

import errno
import hashlib
import os
import re
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import fsspec
import structlog

from app.errors import NotFound, StorageFull

log = structlog.get_logger()
CHUNK_BYTES = 1 << 20
ADDRESS = re.compile("[0-9a-f]{64}")
DRAFT = re.compile(r"\.[0-9a-f]{64}\.[0-9a-f]{16}")


@dataclass(frozen=True, slots=True)
class Stored:
    """Where bytes went: their SHA-256 (hex) and how many there are."""

    sha256: str
    size_bytes: int


class Storage:
    """Content-addressed files below a folder or any fsspec URL."""

    def __init__(self, url: str) -> None:
        self._filesystem: Any
        self._filesystem, root = fsspec.core.url_to_fs(url)
        self.root: str = str(root)
        self._is_local = "file" in self._filesystem.protocol
        self.is_local = self._is_local

    def put(self, data: bytes) -> Stored:
        """Store bytes; returns their address. Raises StorageFull when the disk is full."""
        sha256 = hashlib.sha256(data).hexdigest()
        self._write(self._place(sha256), [data])
        return Stored(sha256, len(data))

    def put_stream(self, stream: IO[bytes]) -> Stored:
        """Store what is left of a seekable stream without holding it in memory.

        Raises StorageFull when the disk is full.
        """
        begin = stream.tell()
        digest = hashlib.sha256()
        size_bytes = 0
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
            size_bytes += len(chunk)
        stream.seek(begin)
        sha256 = digest.hexdigest()
        self._write(self._place(sha256), iter(lambda: stream.read(CHUNK_BYTES), b""))
        return Stored(sha256, size_bytes)

    def read(self, sha256: str) -> bytes:
        """Return the bytes at an address. Raises NotFound when they are gone."""
        return self._read(self._place(sha256))

    def open(self, sha256: str) -> IO[bytes]:
        """Open the bytes at an address to read. Raises NotFound when they are gone."""
        try:
            stream: IO[bytes] = self._filesystem.open(self._place(sha256), "rb")
        except FileNotFoundError as error:
            raise NotFound("the file is gone from the store") from error
        return stream

    def local_path(self, sha256: str) -> Path | None:
        """Return the file's path where the store is a folder, else None."""
        return Path(self._place(sha256)) if self._is_local else None

    def exists(self, sha256: str) -> bool:
        """Whether bytes are stored at an address."""
        return bool(self._filesystem.exists(self._place(sha256)))

    def probe(self) -> None:
        """Write a small file and remove it. Raises StorageFull or OSError when that fails."""
        path = f"{self.root}/derived/probe-{secrets.token_hex(8)}"
        self._write(path, [b"probe"])
        self._filesystem.rm_file(path)

    def size_bytes(self, sha256: str) -> int:
        """Return how many bytes are stored at an address. Raises NotFound when they are gone."""
        try:
            return int(self._filesystem.size(self._place(sha256)))
        except FileNotFoundError as error:
            raise NotFound("the file is gone from the store") from error

    def is_whole(self, sha256: str) -> bool:
        """Whether the bytes at an address are there and still have their SHA-256."""
        digest = hashlib.sha256()
        try:
            with self.open(sha256) as stream:
                while chunk := stream.read(CHUNK_BYTES):
                    digest.update(chunk)
        except NotFound:
            return False
        return digest.hexdigest() == sha256

    def addresses(self) -> Iterator[str]:
        """Give the address of every stored file, derived ones left out."""
        for path in self._filesystem.find(self.root):
            name = str(path).rpartition("/")[2]
            if ADDRESS.fullmatch(name):
                yield name

    def derived(self, name: str, make: Callable[[], bytes]) -> bytes:
        """Return a derived file, made on first use; `name` must be ours, never a user's.

        It can be made again, so a full disk only means that it is not kept.
        """
        path = f"{self.root}/derived/{name}"
        try:
            return self._read(path)
        except NotFound:
            data = make()
        try:
            self._write(path, [data])
        except StorageFull:
            log.warning("derived file not kept: the disk is full", name=name)
        return data

    def remove(self, sha256: str, *, untouched_for_s: float = 3600.0) -> bool:
        """Remove bytes that no row speaks of; False when there are none, or they are in use.

        Somebody may be storing the same bytes again this moment, with the row still to come: what
        was stored (again) within `untouched_for_s` stays.
        """
        path = self._place(sha256)
        if self._is_local:
            return _remove_untouched(Path(path), untouched_for_s)
        if not self._filesystem.exists(path):
            return False
        self._filesystem.rm(path)
        return True

    def remove_drafts(self, *, untouched_for_s: float = 86_400.0) -> int:
        """Remove what writers left that were killed, in a folder; returns how many files."""
        if not self._is_local:
            return 0
        before = time.time() - untouched_for_s
        drafts = (path for path in Path(self.root).rglob(".*") if DRAFT.fullmatch(path.name))
        left = [path for path in drafts if _is_older(path, before)]
        for path in left:
            path.unlink(missing_ok=True)
        return len(left)

    def remove_derived(self, name: str) -> bool:
        """Remove a derived file; False when it was never made."""
        path = f"{self.root}/derived/{name}"
        try:
            self._filesystem.rm_file(path)
        except FileNotFoundError:
            return False
        return True

    def _place(self, sha256: str) -> str:
        return f"{self.root}/{sha256[:2]}/{sha256[2:4]}/{sha256}"

    def _read(self, path: str) -> bytes:
        try:
            return bytes(self._filesystem.cat_file(path))
        except FileNotFoundError as error:
            raise NotFound("the file is gone from the store") from error

    def _write(self, path: str, chunks: Iterable[bytes]) -> None:
        if self._is_local:
            _write_durably(Path(path), chunks)
        elif not self._filesystem.exists(path):
            self._write_remote(path, chunks)

    def _write_remote(self, path: str, chunks: Iterable[bytes]) -> None:
        """Write beside the place and move: a writer closed by an error stores what it has."""
        draft = f"{path}.{secrets.token_hex(8)}.draft"
        self._filesystem.makedirs(path.rpartition("/")[0], exist_ok=True)
        try:
            with self._filesystem.open(draft, "wb") as target:
                for chunk in chunks:
                    target.write(chunk)
            self._filesystem.mv(draft, path)
        except BaseException:
            if self._filesystem.exists(draft):
                self._filesystem.rm(draft)
            raise


def _write_durably(place: Path, chunks: Iterable[bytes]) -> None:
    """Write a file that is there as a whole, also after a power cut, when this returns.

    Raises StorageFull, leaving nothing behind, when the disk is full.
    """
    if _touched(place):
        # Another writer may have moved it there a moment ago and not flushed the folder yet.
        _fsync_folder(place.parent)
        return
    draft = place.with_name(f".{place.name}.{secrets.token_hex(8)}")
    try:
        _make_folders(place.parent)
        with draft.open("xb") as target:
            for chunk in chunks:
                target.write(chunk)
            target.flush()
            os.fsync(target.fileno())
        draft.replace(place)
        _fsync_folder(place.parent)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}:
            raise StorageFull("there is no room left; free some space and try again") from error
        raise


def _touched(place: Path) -> bool:
    """Whether a file is there; its time then says that it is wanted now."""
    try:
        os.utime(place)
    except FileNotFoundError:
        return False
    return True


def _is_older(path: Path, moment_s: float) -> bool:
    """Whether a file was last written before a moment; one that is gone by now was not."""
    try:
        return path.stat().st_mtime < moment_s
    except FileNotFoundError:
        return False


def _remove_untouched(place: Path, untouched_for_s: float) -> bool:
    """Remove a file unless it was touched lately.

    It is moved aside first: whoever touches it before is seen, and whoever comes after finds
    nothing and writes it anew.
    """
    aside = place.with_name(f".{place.name}.{secrets.token_hex(8)}.going")
    try:
        place.rename(aside)
    except FileNotFoundError:
        return False
    if time.time() - aside.stat().st_mtime < untouched_for_s:
        aside.replace(place)
        return False
    aside.unlink()
    return True


def _make_folders(folder: Path) -> None:
    """Make a folder and its missing parents, each flushed into the one above."""
    missing = [each for each in (folder, *folder.parents) if not each.is_dir()]
    for each in reversed(missing):
        each.mkdir(exist_ok=True)
        _fsync_folder(each.parent)


def _fsync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
