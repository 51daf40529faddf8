"""Zip archives for tests: good ones, and those that a sender means harm with.

`zipfile` writes what it may; what it would never write is patched into its bytes afterwards.
"""

import io
import stat
import struct
import zipfile
from collections.abc import Mapping

from tests.factories.ais import table

_CENTRAL = b"PK\x01\x02"
_END = b"PK\x05\x06"
LINK = stat.S_IFLNK | 0o777
PIPE = stat.S_IFIFO | 0o644


def zipped(
    files: Mapping[str, bytes], *, method: int = zipfile.ZIP_DEFLATED, mode: int = 0
) -> bytes:
    """Return an archive; `mode` is the Unix kind and permissions of all its entries."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = method
            info.external_attr = mode << 16
            archive.writestr(info, data)
    return target.getvalue()


def with_field(archive: bytes, offset: int, layout: str, value: int) -> bytes:
    """Return an archive whose first directory record has another value at an offset."""
    at = archive.index(_CENTRAL) + offset
    field = struct.pack(layout, value)
    return archive[:at] + field + archive[at + len(field) :]


def sharing_bytes(name: str, data: bytes, count: int) -> bytes:
    """Return an archive whose directory lists one and the same entry many times."""
    archive = zipped({name: data})
    start, end = archive.index(_CENTRAL), archive.index(_END)
    directory = archive[start:end] * count
    counted = min(count, 0xFFFF)
    closing = struct.pack("<4s4xHHLLH", _END, counted, counted, len(directory), start, 0)
    return archive[:start] + directory + closing


def _name_with_nul() -> bytes:
    return zipped({"a?b.csv": table()}).replace(b"a?b.csv", b"a\0b.csv")


def _damaged_data() -> bytes:
    archive = zipped({"good.csv": table(), "bad.csv": table(4)}, method=zipfile.ZIP_STORED)
    at = archive.rindex(b"ELBE")
    return archive[:at] + b"OSTE" + archive[at + 4 :]


_GOOD = zipped({"good.csv": table()})
_NESTED = zipped({"in.zip": _GOOD}, method=zipfile.ZIP_STORED)

# What is sent, the status it gets, and what the answer must name.
HOSTILE: dict[str, tuple[bytes, int, str]] = {
    "parent": (zipped({"good.csv": table(), "../up.csv": table()}), 422, "'../up.csv'"),
    "parent within": (zipped({"a/../../up.csv": table()}), 422, "'a/../../up.csv'"),
    "absolute": (zipped({"/etc/ais.csv": table()}), 422, "'/etc/ais.csv'"),
    "drive": (zipped({"C:/ais.csv": table()}), 422, "'C:/ais.csv'"),
    "share": (zipped({"//server/ais.csv": table()}), 422, "'//server/ais.csv'"),
    "windows share": (zipped({"\\\\server\\a.csv": table()}), 422, r"'\\\\server\\a.csv'"),
    "backslash": (zipped({"..\\up.csv": table()}), 422, r"'..\\up.csv'"),
    "nul": (_name_with_nul(), 422, r"'a\x00b.csv'"),
    "link": (zipped({"link.csv": b"/etc/passwd"}, mode=LINK), 422, "'link.csv' is a symbolic link"),
    "pipe": (zipped({"pipe.csv": b""}, mode=PIPE), 422, "'pipe.csv'"),
    "full folder": (zipped({"a/": table()}), 422, "'a/'"),
    "encrypted": (with_field(_GOOD, 8, "<H", 1), 422, "'good.csv' is encrypted"),
    "bzip2": (zipped({"b.csv": table()}, method=zipfile.ZIP_BZIP2), 422, "'b.csv'"),
    "lzma": (zipped({"l.csv": table()}, method=zipfile.ZIP_LZMA), 422, "'l.csv'"),
    "damaged data": (_damaged_data(), 422, "'bad.csv' is damaged"),
    "wrong checksum": (with_field(_GOOD, 16, "<L", 0), 422, "'good.csv' is damaged"),
    "smaller claim": (with_field(_GOOD, 24, "<L", 9), 422, "'good.csv' is damaged"),
    "larger claim": (with_field(_GOOD, 24, "<L", 9_999), 422, "'good.csv' is damaged"),
    "outside": (with_field(_GOOD, 42, "<L", 1 << 31), 422, "'good.csv' is damaged"),
    "behind rubbish": (_GOOD[:4] + bytes(50) + _GOOD, 422, "'good.csv' is damaged"),
    "cut off": (_GOOD[:-40], 422, "a zip archive that is damaged or cut off"),
    "cut behind a whole one": (_NESTED[: _NESTED.rindex(_CENTRAL)], 422, "damaged or cut off"),
    "head alone": (_GOOD[:4], 422, "a zip archive that is damaged or cut off"),
    "empty": (zipped({}), 422, "without a file"),
    "only folders": (zipped({"a/": b"", "a/.DS_Store": b"x"}), 422, "without a file"),
    "text": (zipped({"notes.txt": b"Moin"}), 422, "'notes.txt': it begins"),
    "many": (zipped({f"{n}.csv": b"" for n in range(2_001)}), 413, "more than 2,000 entries"),
    "a hundred thousand": (sharing_bytes("a", b"", 100_000), 413, "more than 2,000 entries"),
    "bomb": (zipped({"bomb.csv": bytes(1 << 20)}), 413, "'bomb.csv' unfolds to more than 100"),
    "overlap": (sharing_bytes("twice.csv", table(), 2), 413, "'twice.csv' overlaps another"),
    "nested": (_NESTED, 413, "'in.zip' is itself a zip archive"),
    "nested rar": (zipped({"in.rar": b"Rar!\x1a\x07\x01\x00"}), 413, "a RAR archive"),
    "nested 7z": (zipped({"in.7z": b"7z\xbc\xaf\x27\x1c"}), 413, "a 7-Zip archive"),
    "nested tar": (zipped({"in.tar": bytes(257) + b"ustar\x00"}), 413, "a tar archive"),
}
