"""Zip archives written as a stream, of members that are stored as they are.

Nothing goes back in the file, so it can be sent or hashed while it is written. Members have one
fixed time, so the same members give the same bytes. Photographs are packed already: nothing is
deflated. The directory, which comes last, is kept packed meanwhile, because a data set of a million
photographs has a long one. Format: PKWARE's APPNOTE 6.3.10, ZIP64 where 32 bits do not suffice.
"""

import struct
import zlib
from collections.abc import Iterable, Iterator

Member = tuple[str, bytes | Iterable[bytes]]
_LOCAL = struct.Struct("<4sHHHHHIIIHH")
_CENTRAL = struct.Struct("<4sHHHHHHIIIHHHHHII")
_END64 = struct.Struct("<4sQHHIIQQQQ")
_LOCATOR64 = struct.Struct("<4sIQI")
_END = struct.Struct("<4sHHHHIIH")
_TIME, _DATE = 0, (2000 - 1980) << 9 | 1 << 5 | 1  # 2000-01-01, midnight
_UTF8, _DESCRIBED_BEHIND = 0x0800, 0x0008
_VERSION, _VERSION64 = 20, 45
_MADE_ON_UNIX = 3 << 8
_PLAIN_FILE = 0o100644 << 16
_MOST_32, _MOST_16 = 0xFFFFFFFF, 0xFFFF


def zip_stream(members: Iterable[Member]) -> Iterator[bytes]:
    """Give an archive's bytes; a member whose content comes in chunks may be of any size."""
    directory = _Directory()
    offset = 0
    for name, content in members:
        for chunk in _member(name, content, offset, directory):
            offset += len(chunk)
            yield chunk
    yield from directory.written(offset)


def _member(
    name: str, content: bytes | Iterable[bytes], offset: int, directory: "_Directory"
) -> Iterator[bytes]:
    encoded = name.encode()
    if isinstance(content, bytes):
        crc, size = zlib.crc32(content), len(content)
        yield (
            _LOCAL.pack(
                *(b"PK\x03\x04", _VERSION, _UTF8, 0, _TIME, _DATE),
                *(crc, size, size, len(encoded), 0),
            )
            + encoded
            + content
        )
        directory.add(encoded, _UTF8, crc, size, offset)
        return
    flags = _UTF8 | _DESCRIBED_BEHIND
    extra = struct.pack("<HHQQ", 1, 16, 0, 0)
    yield (
        _LOCAL.pack(
            *(b"PK\x03\x04", _VERSION64, flags, 0, _TIME, _DATE),
            *(0, _MOST_32, _MOST_32, len(encoded), len(extra)),
        )
        + encoded
        + extra
    )
    crc = size = 0
    for chunk in content:
        crc = zlib.crc32(chunk, crc)
        size += len(chunk)
        yield chunk
    yield struct.pack("<4sIQQ", b"PK\x07\x08", crc, size, size)
    directory.add(encoded, flags, crc, size, offset)


class _Directory:
    """The list of members, packed until it is written."""

    def __init__(self) -> None:
        self._packer = zlib.compressobj(1)
        self._packed: list[bytes] = []
        self._count = 0

    def add(self, name: bytes, flags: int, crc: int, size: int, offset: int) -> None:
        wide = b""
        if size >= _MOST_32:
            wide += struct.pack("<QQ", size, size)
        if offset >= _MOST_32:
            wide += struct.pack("<Q", offset)
        extra = struct.pack("<HH", 1, len(wide)) + wide if wide else b""
        version = _VERSION64 if wide or flags & _DESCRIBED_BEHIND else _VERSION
        entry = _CENTRAL.pack(
            *(b"PK\x01\x02", _MADE_ON_UNIX | _VERSION64, version, flags, 0, _TIME, _DATE),
            *(crc, min(size, _MOST_32), min(size, _MOST_32), len(name), len(extra), 0, 0, 0),
            *(_PLAIN_FILE, min(offset, _MOST_32)),
        )
        self._packed.append(self._packer.compress(entry + name + extra))
        if len(self._packed) > 1000:
            self._packed = [b"".join(self._packed)]
        self._count += 1

    def written(self, offset: int) -> Iterator[bytes]:
        unpacker = zlib.decompressobj()
        size = 0
        for packed in (*self._packed, self._packer.flush()):
            piece = unpacker.decompress(packed)
            size += len(piece)
            yield piece
        if self._count >= _MOST_16 or max(offset, size) >= _MOST_32:
            yield _END64.pack(
                *(b"PK\x06\x06", _END64.size - 12, _MADE_ON_UNIX | _VERSION64, _VERSION64, 0, 0),
                *(self._count, self._count, size, offset),
            )
            yield _LOCATOR64.pack(b"PK\x06\x07", 0, offset + size, 1)
        count = min(self._count, _MOST_16)
        yield _END.pack(
            *(b"PK\x05\x06", 0, 0, count, count),
            *(min(size, _MOST_32), min(offset, _MOST_32), 0),
        )
