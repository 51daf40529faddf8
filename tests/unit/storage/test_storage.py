"""The file store on a folder and on a bucket: addresses, order of flushing, full disks."""

import hashlib
import io
import os
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fsspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import NotFound, StorageFull
from app.storage import CHUNK_BYTES, Storage
from tests.small_disk import fill, small_disk


@pytest.fixture(params=["folder", "bucket"])
def storage(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Storage]:
    """Give a store in a folder, and one behind an fsspec URL."""
    if request.param == "folder":
        yield Storage(str(tmp_path / "files"))
        return
    url = f"memory://store-{uuid.uuid4().hex}"
    yield Storage(url)
    filesystem, root = fsspec.core.url_to_fs(url)
    if filesystem.exists(root):
        filesystem.rm(root, recursive=True)


def files(storage: Storage) -> list[str]:
    """Return the names of all files in a store."""
    filesystem, _ = fsspec.core.url_to_fs("/" if storage.local_path("00") else "memory://")
    return [path.rpartition("/")[2] for path in filesystem.find(storage.root)]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(data=st.binary(max_size=2000))
def test_bytes_come_back_from_their_address(storage: Storage, data: bytes) -> None:
    """The address is the SHA-256, and what is read there is what was stored."""
    stored = storage.put(data)
    assert (stored.sha256, stored.size_bytes) == (hashlib.sha256(data).hexdigest(), len(data))
    assert storage.exists(stored.sha256)
    assert storage.read(stored.sha256) == data


def test_the_same_bytes_are_stored_once(storage: Storage) -> None:
    """Whole or as a stream, the same bytes are one file."""
    data = os.urandom(3 * CHUNK_BYTES + 17)
    streamed = storage.put_stream(io.BytesIO(data))
    assert storage.put(data) == streamed
    assert files(storage) == [streamed.sha256]


def test_a_stream_is_stored_from_where_it_stands(storage: Storage) -> None:
    """What was read of a stream already does not belong to the file."""
    stream = io.BytesIO(b"header" + b"body" * 10)
    stream.seek(6)
    assert storage.read(storage.put_stream(stream).sha256) == b"body" * 10


def test_a_file_is_read_in_parts(storage: Storage) -> None:
    """An open file can be read from anywhere, as ranges of a download are."""
    stored = storage.put(bytes(range(256)) * 100)
    with storage.open(stored.sha256) as stream:
        stream.seek(300)
        assert stream.read(4) == bytes([44, 45, 46, 47])


def test_what_is_not_there_is_not_found(storage: Storage) -> None:
    """An address without bytes is NotFound, whichever way it is asked for."""
    absent = "0" * 64
    assert not storage.exists(absent)
    with pytest.raises(NotFound):
        storage.read(absent)
    with pytest.raises(NotFound):
        storage.open(absent)


def test_many_writers_of_the_same_bytes_make_one_file(storage: Storage) -> None:
    """The same upload twice at once leaves one whole file and no draft."""
    data = os.urandom(CHUNK_BYTES)
    with ThreadPoolExecutor(8) as pool:
        stored = set(pool.map(lambda _: storage.put(data), range(16)))
    assert len(stored) == 1
    assert files(storage) == [stored.pop().sha256]


class Broken(io.BytesIO):
    """A stream that breaks when it is read for the second time, after its first chunk."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self._rounds = 0

    def seek(self, offset: int, whence: int = 0) -> int:
        """Begin a new round."""
        self._rounds += 1
        return super().seek(offset, whence)

    def read(self, size: int | None = -1) -> bytes:
        """Read, or break."""
        if self._rounds and self.tell():
            raise ConnectionError("the line went dead")
        return super().read(size)


def test_a_write_that_breaks_off_leaves_nothing(storage: Storage) -> None:
    """Half a file never stands at an address, and no draft stays behind."""
    with pytest.raises(ConnectionError):
        storage.put_stream(Broken(os.urandom(2 * CHUNK_BYTES)))
    assert files(storage) == []


def test_a_derived_file_is_made_once(storage: Storage) -> None:
    """The second reader gets what the first one had made."""
    made: list[int] = []

    def make() -> bytes:
        made.append(1)
        return b"preview"

    assert [storage.derived("previews/a-640.jpg", make) for _ in range(2)] == [b"preview"] * 2
    assert made == [1]


def test_a_file_is_flushed_before_it_is_moved_and_its_folders_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes, then the name, then each new folder: a power cut after `put` takes nothing away."""
    happened: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def spied_fsync(descriptor: int) -> None:
        path = Path(f"/proc/self/fd/{descriptor}").readlink()
        happened.append(f"flush {'draft' if path.is_file() else path.relative_to(tmp_path)}")
        fsync(descriptor)

    def spied_replace(path: Path, target: Path) -> Path:
        happened.append("move")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", spied_fsync)
    monkeypatch.setattr(Path, "replace", spied_replace)
    storage = Storage(str(tmp_path / "files"))
    sha256 = storage.put(b"photograph").sha256
    one, two = sha256[:2], sha256[2:4]
    assert happened == [
        "flush .",
        "flush files",
        f"flush files/{one}",
        "flush draft",
        "move",
        f"flush files/{one}/{two}",
    ]
    happened.clear()
    storage.put(b"photograph")
    assert happened == [f"flush files/{one}/{two}"]


def test_a_full_disk_is_told_and_left_clean(tmp_path: Path) -> None:
    """Without room nothing is left behind, and with room again the same store goes on."""
    with small_disk(tmp_path / "disk", 1 << 20) as disk:
        storage = Storage(str(disk / "files"))
        kept = storage.put(b"early bird")
        ballast = fill(disk, leave_bytes=64 << 10)
        data = os.urandom(256 << 10)
        for write in (storage.put, lambda data: storage.put_stream(io.BytesIO(data))):
            with pytest.raises(StorageFull):
                write(data)
        assert files(storage) == [kept.sha256]
        assert storage.derived("previews/big.jpg", lambda: data) == data
        assert storage.read(kept.sha256) == b"early bird"
        ballast.unlink()
        assert storage.read(storage.put(data).sha256) == data


def test_a_disk_without_room_for_a_folder_is_full_too(tmp_path: Path) -> None:
    """The very first write to a full disk is the same error."""
    with small_disk(tmp_path / "disk", 64 << 10) as disk:
        fill(disk)
        with pytest.raises(StorageFull):
            Storage(str(disk / "files")).put(b"x" * 8192)
