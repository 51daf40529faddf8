"""The folder a backup is written in: beside its target, so that the whole gets its name at once.

It goes with the backup, however that ends. One that was killed leaves its folder behind; nobody
holds its lock then, by which the next backup there knows it and removes it.
"""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from app.keeping.archive import OWNER_ONLY

PREFIX = ".quaymark-backup-"
LOCK = "lock"


@contextmanager
def drafts_beside(path: Path) -> Iterator[Path]:
    """Give a folder for the drafts of a backup, and remove those of backups that were killed."""
    for abandoned in path.parent.glob(f"{PREFIX}*/{LOCK}"):
        _remove_if_free(abandoned)
    with (
        tempfile.TemporaryDirectory(prefix=PREFIX, dir=path.parent) as name,
        (Path(name) / LOCK).open("wb") as lock,
    ):
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Path(name)


def _remove_if_free(lock: Path) -> None:
    try:
        with lock.open("rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(lock.parent, ignore_errors=True)
    except OSError:
        return  # a backup is at work there, or another has just removed it


@contextmanager
def whole_or_not(drafts: Path, path: Path) -> Iterator[IO[bytes]]:
    """Give a draft that gets its name, safe from a power cut, when the block ends well."""
    draft = drafts / "archive"
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, OWNER_ONLY)
    with os.fdopen(descriptor, "wb") as target:
        yield target
        target.flush()
        os.fsync(target.fileno())
    draft.replace(path)
