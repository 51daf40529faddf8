"""A disk of a few hundred kilobytes, to be filled: a real tmpfs, mounted by root."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

BLOCK_BYTES = 4096


@contextmanager
def small_disk(place: Path, size_bytes: int) -> Iterator[Path]:
    """Mount a small disk at a new folder; skips the test where that is not allowed."""
    if os.geteuid() != 0:
        pytest.skip("needs root to mount a small disk")
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={size_bytes}", "tmpfs", str(place)]
    mounted = subprocess.run(command, capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"cannot mount a small disk here: {mounted.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def fill(disk: Path, *, leave_bytes: int = 0) -> Path:
    """Fill a disk up to some bytes; returns the file to delete for room."""
    ballast = disk / "ballast"
    free = os.statvfs(disk).f_bavail * BLOCK_BYTES - leave_bytes
    # Whoever writes meanwhile takes some of the room: what is left then is filled all the same.
    with suppress(OSError), ballast.open("wb", buffering=0) as target:
        target.write(b"\0" * max(free, 0))
    return ballast
