"""Where a backup is written: whole or not at all, and nothing left behind for long."""

import io
from pathlib import Path

import pytest

from app.keeping.archive import ArchiveWriter
from app.keeping.drafts import LOCK, PREFIX, drafts_beside, whole_or_not

CHUNK = 10_240


class _SmallDisk(io.BytesIO):
    """A file that holds two blocks."""

    def write(self, data: object, /) -> int:
        if self.tell() > CHUNK:
            raise OSError(28, "No space left on device")
        return super().write(data)  # type: ignore[arg-type]  # as it came


def test_what_a_killed_backup_left_goes_with_the_next(tmp_path: Path) -> None:
    """A folder whose lock nobody holds is removed; that of a backup at work stays."""
    killed = tmp_path / f"{PREFIX}killed"
    killed.mkdir()
    (killed / LOCK).touch()
    (killed / "archive").write_bytes(b"half")
    with drafts_beside(tmp_path / "first.tar") as first:
        assert not killed.exists()
        with drafts_beside(tmp_path / "second.tar") as second:
            assert first.exists()
            with whole_or_not(second, tmp_path / "second.tar") as target:
                target.write(b"whole")
        with pytest.raises(ValueError, match="half"), whole_or_not(first, tmp_path / "first.tar"):
            raise ValueError("half")
    assert [path.name for path in tmp_path.iterdir()] == ["second.tar"]


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_full_disk_is_told_once() -> None:
    """The error of the disk comes out, and the archive that was given up complains no more."""
    with pytest.raises(OSError, match="No space"), ArchiveWriter(_SmallDisk()) as archive:
        archive.add_bytes("much", bytes(9 * CHUNK))
