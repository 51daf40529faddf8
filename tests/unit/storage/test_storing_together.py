"""Many files into the store at once: order of flushing, what breaks off, a full disk."""

import hashlib
import os
from pathlib import Path

import fsspec
import pytest

from app import storing_together
from app.errors import StorageFull
from app.storage import Storage
from app.storing_together import FEW, StoringTogether
from tests.small_disk import fill, small_disk


def addressed(*contents: bytes) -> dict[str, bytes]:
    """Return contents by their addresses."""
    return {hashlib.sha256(data).hexdigest(): data for data in contents}


def store(storage: Storage, contents: dict[str, bytes]) -> None:
    """Store contents together."""
    with StoringTogether(storage) as together:
        for sha256, data in contents.items():
            together.add(sha256, data)
        together.settle()


def names(folder: Path) -> list[str]:
    """Return the names of all files below a folder."""
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("count", [1, FEW + 2])
def test_nothing_is_at_its_place_before_it_is_flushed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """Drafts are flushed, moved, and their folders flushed: few one by one, many together."""
    at_flush: list[int] = []
    contents = addressed(*(os.urandom(100) for _ in range(count)))
    storage = Storage(str(tmp_path / "files"))
    for name in ("_flush_each", "_flush_all"):
        real = getattr(storing_together, name)

        def spied(what: object, real: object = real) -> None:
            at_flush.append(sum(storage.exists(sha256) for sha256 in contents))
            real(what)  # type: ignore[operator]

        monkeypatch.setattr(storing_together, name, spied)
    store(storage, contents)
    assert at_flush == [0, count]
    assert {sha256: storage.read(sha256) for sha256 in contents} == contents
    at_flush.clear()
    store(storage, contents)  # another writer's, perhaps, that is not flushed yet
    assert at_flush[-1] == count
    assert names(tmp_path) == sorted(contents)


def test_what_is_left_unsettled_leaves_nothing(tmp_path: Path) -> None:
    """Whatever comes between adding and settling, the drafts go, and only those."""
    storage = Storage(str(tmp_path))
    kept = storage.put(b"there before").sha256
    with StoringTogether(storage) as together:
        for sha256, data in addressed(b"there before", b"new").items():
            together.add(sha256, data)
        assert len(names(tmp_path)) == 2
    assert names(tmp_path) == [kept]


def test_a_full_disk_is_told_and_left_clean(tmp_path: Path) -> None:
    """Without room for the last file none is stored; with room again all are."""
    contents = addressed(*(os.urandom(48 << 10) for _ in range(FEW + 2)))
    with small_disk(tmp_path / "disk", 1 << 20) as disk:
        ballast = fill(disk, leave_bytes=200 << 10)
        storage = Storage(str(disk / "files"))
        with pytest.raises(StorageFull):
            store(storage, contents)
        assert names(disk / "files") == []
        ballast.unlink()
        store(storage, contents)
        assert names(disk / "files") == sorted(contents)


def test_a_bucket_takes_them_as_they_come() -> None:
    """Behind a URL each file is stored by itself."""
    storage = Storage("memory://together")
    contents = addressed(b"one", b"two")
    store(storage, contents)
    assert {sha256: storage.read(sha256) for sha256 in contents} == contents
    filesystem, root = fsspec.core.url_to_fs("memory://together")
    filesystem.rm(root, recursive=True)


def test_drafts_of_a_killed_writer_go_after_a_day(tmp_path: Path) -> None:
    """What nobody finished is removed, but neither files nor what is being written now."""
    storage = Storage(str(tmp_path))
    old, young = addressed(b"old", b"young")
    left = StoringTogether(storage)
    left.add(old, b"old")
    (draft,) = tmp_path.rglob(f".{old}.*")
    kept = storage.put(b"a file").sha256
    for path in (draft, *tmp_path.rglob(kept)):
        os.utime(path, (0, 0))
    left.add(young, b"young")
    assert storage.remove_drafts() == 1
    assert [name.partition(".")[2][:64] or name for name in names(tmp_path)] == [young, kept]
