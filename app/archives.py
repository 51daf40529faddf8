"""Zip archives from strangers: their directory is judged as a whole before an entry is opened.

A zip is a list of claims: names, sizes, places. Names may point out of any folder, sizes may claim
little and unfold into a full disk, many entries may share the same bytes. So all claims are checked
against each other and against the limits first. Only then entries are read, a piece at a time, and
each to its end, where its checksum stands. Nothing is ever written under a name from an archive.

Formats: PKWARE's APPNOTE 6.3.10; the overlapping entries of D. Fifield, "A better zip bomb" (2019).
"""

import io
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, NoReturn

from app.errors import Invalid, TooLarge

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

MAGIC = re.compile(rb"PK(\x03\x04|\x05\x06|\x07\x08)")  # a first entry, none, a part of several
_NESTED = (
    (MAGIC, "a zip archive"),
    (re.compile(rb"Rar!\x1a\x07"), "a RAR archive"),
    (re.compile(rb"7z\xbc\xaf\x27\x1c"), "a 7-Zip archive"),
    (re.compile(rb".{257}ustar", re.DOTALL), "a tar archive"),
)
_HEAD_BYTES = 512  # as far as a tar's mark
_CHUNK_BYTES = 1 << 18
# Long names and extra fields included; zipfile reads the directory in one piece.
_DIRECTORY_BYTES_OF_AN_ENTRY = 512
_COMMENT_BYTES = 1 << 17  # an archive's comment has up to 64 KiB
# Below this no ratio is suspicious: a page of spaces is no bomb.
_HARMLESS_BYTES = 64 << 10
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 0x0001 | 0x0040 | 0x2000  # flags: encrypted, strongly encrypted, masked headers
_DRIVE = re.compile(r"[A-Za-z]:")
_LOCAL_HEADER = struct.Struct("<4s22xHH")  # signature, length of the name, of the extra field
_LONGEST_DESCRIPTOR_BYTES = 24  # sizes and checksum behind data whose writer could not go back
_LOCAL_SIGNATURE = b"PK\x03\x04"
_LONGEST_SHOWN = 120
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    ValueError,  # a name that is no UTF-8, a place before the beginning
    OverflowError,
    NotImplementedError,
)


@dataclass(frozen=True, slots=True)
class Limits:
    """How much an archive may hold: bytes once unfolded, entries, bytes out of each packed one."""

    unfolded_bytes: int
    entries: int = 2_000
    ratio: int = 100


def is_zip(stream: IO[bytes]) -> bool:
    """Whether a seekable stream begins as a zip archive does; leaves it at its beginning."""
    stream.seek(0)
    head = stream.read(4)
    stream.seek(0)
    return MAGIC.match(head) is not None


def entries(
    stream: IO[bytes], limits: Limits, passed_over: list[str] | None = None
) -> Iterator[tuple[str, IO[bytes]]]:
    """Check a zip archive's whole directory, then iterate its files.

    Args:
        stream: seekable; stays open, and must stay so while the entries are read.
        limits: what the caller has room for.
        passed_over: gets the names of the files that are passed over, if given.

    Returns:
        Name and seekable stream of each file, in the archive's order; a stream is good until the
        next one is asked for. What the caller leaves unread is read for its checksum. Folders and
        what macOS adds (`__MACOSX/`, `.DS_Store`) are passed over.

    Raises:
        Invalid: damaged or cut off; an entry with a name that leaves its folder, a link, an
            encrypted one. Damage within an entry shows when it is read, so store nothing before
            the last entry has ended.
        TooLarge: beyond the limits, entries that share bytes, an archive within the archive.

    """
    archive = _opened(stream, limits)
    listed = archive.infolist()
    if len(listed) > limits.entries:
        raise TooLarge(_too_many(limits))
    for info in listed:
        _check_name(info)
        _check_kind(info)
    _check_sizes(listed, limits)
    _check_places(stream, listed, archive.start_dir)
    wanted = [info for info in listed if not _is_passed_over(info)]
    if passed_over is not None:
        passed_over += [
            info.filename for info in listed if _is_passed_over(info) and not _is_folder(info)
        ]
    for info in wanted:
        _refuse_an_archive(archive, info)
    return _read(archive, wanted)


class _InPieces(io.RawIOBase):
    """The archive's bytes, which nobody may ask for by the hundred megabytes.

    zipfile takes the directory in one read of the length that the archive claims, whatever number
    of entries it claims besides, and makes an object of each entry. This bounds both.
    """

    def __init__(self, stream: IO[bytes], limits: Limits) -> None:
        super().__init__()
        self._stream = stream
        self._limits = limits
        self._longest = _COMMENT_BYTES + limits.entries * _DIRECTORY_BYTES_OF_AN_ENTRY

    def read(self, size: int = -1, /) -> bytes:
        if size > self._longest:
            raise TooLarge(_too_many(self._limits))
        return self._stream.read(size if size >= 0 else self._longest)

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        return self._stream.seek(offset, whence)

    def tell(self) -> int:
        return self._stream.tell()

    def seekable(self) -> bool:
        return True


class _Entry(io.RawIOBase):
    """An entry's bytes; damage is told as the user's to mend, by the entry's name."""

    def __init__(self, source: IO[bytes], info: zipfile.ZipInfo) -> None:
        super().__init__()
        self._source = source
        self._info = info

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        return self._source.seek(offset, whence)

    def tell(self) -> int:
        return self._source.tell()

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        target = memoryview(buffer)
        try:
            data = self._source.read(len(target))
        except _DAMAGE as error:
            raise _damaged(self._info, error) from error
        if not data and self._source.tell() < self._info.file_size:
            raise _damaged(self._info, "shorter than its directory says")
        target[: len(data)] = data
        return len(data)


def _opened(stream: IO[bytes], limits: Limits) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(_InPieces(stream, limits))
    except _DAMAGE as error:
        raise Invalid.field(
            "file", f"this is a zip archive that is damaged or cut off ({error}); make it again"
        ) from error


def _read(
    archive: zipfile.ZipFile, wanted: Iterable[zipfile.ZipInfo]
) -> Iterator[tuple[str, IO[bytes]]]:
    for info in wanted:
        with _entry(archive, info) as entry:
            yield info.filename, entry
            while entry.read(_CHUNK_BYTES):
                pass


def _entry(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> io.BufferedReader:
    try:
        return io.BufferedReader(_Entry(archive.open(info), info), _CHUNK_BYTES)
    except _DAMAGE as error:
        raise _damaged(info, error) from error


def _check_name(info: zipfile.ZipInfo) -> None:
    """Refuse a name that would mean a place outside of a folder, on whatever system."""
    name = info.orig_filename  # `filename` ends before a NUL
    if "\x00" in name:
        _refuse(info, "has a NUL character in its name")
    if "\\" in name:
        _refuse(info, "has a backslash in its name; zip names its folders with slashes")
    if name.startswith("/") or _DRIVE.match(name):
        _refuse(info, "has an absolute name; name entries from the archive's own top")
    if ".." in name.split("/"):
        _refuse(info, "has a name that leads out of the archive with '..'")


def _check_kind(info: zipfile.ZipInfo) -> None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind == stat.S_IFLNK:
        _refuse(info, "is a symbolic link; put the file itself in")
    if kind not in {0, stat.S_IFREG, stat.S_IFDIR}:
        _refuse(info, "is a device or a pipe, not a file")
    if _is_folder(info) and info.file_size:
        _refuse(info, "claims to be a folder and yet holds bytes")
    if info.flag_bits & _ENCRYPTED:
        _refuse(info, "is encrypted; make the archive without a password")
    if info.compress_type not in _METHODS:
        _refuse(info, f"is packed by method {info.compress_type}; taken are deflate and stored")


def _check_sizes(listed: Iterable[zipfile.ZipInfo], limits: Limits) -> None:
    """Believe the sizes claimed: no entry is read beyond its own, and a wrong one fails its CRC."""
    total = 0
    for info in listed:
        total += info.file_size
        if total > limits.unfolded_bytes:
            raise TooLarge(
                f"the archive unfolds into more than {limits.unfolded_bytes:,} bytes; split it"
            )
        if info.file_size > max(_HARMLESS_BYTES, limits.ratio * info.compress_size):
            raise TooLarge(
                f"the archive's entry {_shown(info)} unfolds to more than {limits.ratio} times its "
                "packed size, as bombs do; upload it unpacked"
            )


def _check_places(stream: IO[bytes], listed: list[zipfile.ZipInfo], directory: int) -> None:
    """Refuse entries that share bytes, and bytes that no entry owns: each ends where one begins.

    Before the first one stands something when an archive is cut off behind a whole one inside of
    it; between two when a damaged record of the directory swallows the next.
    """
    spans = sorted(
        ((info.header_offset, _end(stream, info, directory), info) for info in listed),
        key=lambda span: span[:2],
    )
    if spans and spans[0][0] != 0:
        raise _damaged(spans[0][2], "the bytes before it belong to no entry")
    starts = [*(start for start, _, _ in spans), directory]
    for (_, end, info), start in zip(spans, starts[1:], strict=True):
        if start < end:
            raise TooLarge(f"the archive's entry {_shown(info)} overlaps another, as bombs do")
        if start - end > _LONGEST_DESCRIPTOR_BYTES:
            raise _damaged(info, "the bytes behind it belong to no entry")


def _end(stream: IO[bytes], info: zipfile.ZipInfo, directory: int) -> int:
    """Return where an entry's data ends; a data descriptor behind it does not count."""
    if not 0 <= info.header_offset <= directory - _LOCAL_HEADER.size:
        raise _damaged(info, "it lies outside of the archive")
    stream.seek(info.header_offset)
    header = stream.read(_LOCAL_HEADER.size)
    if len(header) < _LOCAL_HEADER.size or not header.startswith(_LOCAL_SIGNATURE):
        raise _damaged(info, "there is no entry where the directory says")
    _, name_bytes, extra_bytes = _LOCAL_HEADER.unpack(header)
    end: int = (
        info.header_offset + _LOCAL_HEADER.size + name_bytes + extra_bytes + info.compress_size
    )
    if end > directory:
        raise _damaged(info, "it reaches into the directory")
    return end


def _is_passed_over(info: zipfile.ZipInfo) -> bool:
    parts = info.filename.split("/")
    return _is_folder(info) or parts[0] == "__MACOSX" or parts[-1] == ".DS_Store"


def _is_folder(info: zipfile.ZipInfo) -> bool:
    return info.is_dir() or stat.S_ISDIR(info.external_attr >> 16)


def _refuse_an_archive(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
    with _entry(archive, info) as entry:
        head = entry.read(_HEAD_BYTES)
    for magic, kind in _NESTED:
        if magic.match(head):
            raise TooLarge(
                f"the archive's entry {_shown(info)} is itself {kind}; put the files in directly"
            )


def _shown(info: zipfile.ZipInfo) -> str:
    name = info.orig_filename
    return repr(name if len(name) <= _LONGEST_SHOWN else f"{name[:_LONGEST_SHOWN]}…")


def _too_many(limits: Limits) -> str:
    return f"the archive has more than {limits.entries:,} entries; split it"


def _refuse(info: zipfile.ZipInfo, reason: str) -> NoReturn:
    raise Invalid.field("file", f"its entry {_shown(info)} {reason}")


def _damaged(info: zipfile.ZipInfo, reason: object) -> Invalid:
    return Invalid.field(
        "file", f"its entry {_shown(info)} is damaged or cut off ({reason}); make the archive again"
    )
