"""Many files into the store at once, with two flushes for all of them instead of five for each.

What `Storage.put` promises holds here too: when this returns, the files are there as a whole, also
after a power cut. All drafts are written and flushed first, then moved to their places, then the
folders are flushed: a file is never at its place before its bytes are on the disk.
"""

import ctypes
import errno
import os
import secrets
from collections.abc import Mapping
from pathlib import Path

from app.errors import StorageFull
from app.storage import Storage

FEW = 4  # so many files are flushed faster one by one
FULL = frozenset({errno.ENOSPC, errno.EDQUOT})


def put_many(storage: Storage, contents: Mapping[str, bytes]) -> None:
    """Store bytes by their SHA-256 (hex), which the caller has computed.

    Raises StorageFull, leaving nothing half written, when the disk is full.
    """
    places = {sha256: storage.local_path(sha256) for sha256 in contents}
    local = {sha256: path for sha256, path in places.items() if path is not None}
    for sha256 in contents.keys() - local.keys():
        storage.put(contents[sha256])
    missing = {sha256: path for sha256, path in local.items() if not _touched(path)}
    if len(missing) <= FEW:
        for sha256 in local:
            storage.put(contents[sha256])
        return
    try:
        _write(Path(storage.root), {path: contents[sha256] for sha256, path in missing.items()})
        if local:
            # Those found there may be another writer's, whose flush has not come yet.
            _flush(Path(storage.root))
    except OSError as error:
        if error.errno in FULL:
            raise StorageFull("there is no room left; free some space and try again") from error
        raise


def _touched(path: Path) -> bool:
    """Whether a file is there; if so, it is now too young to be swept away as unused."""
    try:
        os.utime(path)
    except FileNotFoundError:
        return False
    return True


def _write(root: Path, files: Mapping[Path, bytes]) -> None:
    drafts: dict[Path, Path] = {}
    try:
        for place, data in files.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            draft = place.with_name(f".{place.name}.{secrets.token_hex(8)}")
            drafts[place] = draft
            draft.write_bytes(data)
        if drafts:
            _flush(root)
        for place, draft in drafts.items():
            draft.replace(place)
    except BaseException:
        for draft in drafts.values():
            draft.unlink(missing_ok=True)
        raise


def _flush(root: Path) -> None:
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
            raise OSError(code, os.strerror(code), str(root))
    finally:
        os.close(descriptor)
