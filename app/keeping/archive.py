"""A backup as a file: a tar archive that says what it holds and proves it.

    quaymark-backup.json       first: format, versions, when
    tables/NAME.ndjson.gz      one JSON array a row, in the order of the manifest's columns
    files/SHA-256              the store's files, as they are
    manifest.json              last: rows and SHA-256 of each table, files, jobs under way

Rows are written in a neutral form, so an archive made on SQLite can be restored on Postgres and the
other way round. An archive without its manifest was cut short and is refused.
"""

import hashlib
import io
import json
import tarfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any, Self

from app.errors import Invalid

FORMAT = 1
HEADER, MANIFEST, SECRET = "quaymark-backup.json", "manifest.json", "secret"
CHUNK_BYTES = 1 << 20
OWNER_ONLY = 0o600


@dataclass(frozen=True, slots=True)
class TableEntry:
    """One table of an archive: its columns with their kinds, rows, and its member's SHA-256."""

    name: str
    columns: Mapping[str, str]
    rows: int
    sha256: str

    @property
    def member(self) -> str:
        """The name of the member with the rows."""
        return f"tables/{self.name}.ndjson.gz"


@dataclass(frozen=True, slots=True)
class JobEntry:
    """A job that had not ended: it begins anew after a restore."""

    job_id: str
    name: str
    queue: str
    arguments: Sequence[Any]


@dataclass(frozen=True, slots=True)
class Header:
    """What made an archive, and when."""

    version: str
    revision: str
    database: str
    created_at: str
    format: int = FORMAT


@dataclass(frozen=True, slots=True)
class Manifest:
    """What an archive holds; `missing` and `damaged` files were so in the store already."""

    tables: Sequence[TableEntry]
    jobs: Sequence[JobEntry]
    file_count: int
    file_bytes: int
    missing: Sequence[str] = field(default_factory=tuple)
    damaged: Sequence[str] = field(default_factory=tuple)
    secret_sha256: str | None = None

    @property
    def rows(self) -> int:
        """Rows of all tables."""
        return sum(table.rows for table in self.tables)


class ArchiveWriter:
    """Writes the members of an archive, in order, to a stream that need not be seekable.

    A context manager: its end is written when the block ends well.
    """

    def __init__(self, target: IO[bytes]) -> None:
        self._tar = tarfile.open(fileobj=target, mode="w|")  # noqa: SIM115  closed by `close`

    def add_json(self, name: str, content: object) -> None:
        """Add a small JSON member."""
        self.add_bytes(name, json.dumps(content, indent=1).encode())

    def add_bytes(self, name: str, data: bytes) -> None:
        """Add a member held in memory."""
        self.add_stream(name, io.BytesIO(data), len(data))

    def add_stream(self, name: str, source: IO[bytes], size_bytes: int) -> str:
        """Add a member of a known size and return its SHA-256. Raises OSError when it is short."""
        member = tarfile.TarInfo(name)
        member.size, member.mode = size_bytes, OWNER_ONLY
        reader = _HashingReader(source)
        self._tar.addfile(member, reader)
        return reader.sha256

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # After a failure it is closed all the same, or tarfile complains of it when it is freed.
        with suppress(OSError) if kind else nullcontext():
            self._tar.close()


class _HashingReader:
    """A stream that hashes what is read from it."""

    def __init__(self, source: IO[bytes]) -> None:
        self._source = source
        self._digest = hashlib.sha256()

    def read(self, size: int = -1) -> bytes:
        data = self._source.read(size)
        self._digest.update(data)
        return data

    @property
    def sha256(self) -> str:
        return self._digest.hexdigest()


class Archive:
    """An archive opened to be read; a context manager."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._tar = tarfile.open(path, "r:")  # noqa: SIM115  closed by `__exit__`
            self._members = {member.name: member for member in self._tar.getmembers()}
        except tarfile.TarError as error:
            raise self._refused("it is no backup, or was cut short") from error
        self.header = self._header()
        self.manifest = self._manifest()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._tar.close()

    def files(self) -> Iterator[str]:
        """Give the SHA-256 of each file that the archive holds unharmed."""
        damaged = frozenset(self.manifest.damaged)
        for name in self._members:
            folder, _, sha256 = name.rpartition("/")
            if folder == "files" and sha256 not in damaged:
                yield sha256

    @contextmanager
    def open(self, name: str) -> Iterator[IO[bytes]]:
        """Open a member. Raises Invalid when there is none of this name."""
        member = self._members.get(name)
        stream = self._tar.extractfile(member) if member is not None and member.isreg() else None
        if stream is None:
            raise self._refused(f"{name} is missing in it")
        with stream:
            yield stream

    def read(self, name: str) -> bytes:
        """Return a small member's bytes."""
        with self.open(name) as stream:
            return stream.read()

    def verify(self, told: Callable[[int], None]) -> None:
        """Hash every member and compare; `told` hears of each. Raises Invalid naming the first."""
        expected = {table.member: table.sha256 for table in self.manifest.tables}
        expected |= {f"files/{sha256}": sha256 for sha256 in self.files()}
        if self.manifest.secret_sha256 is not None:
            expected[SECRET] = self.manifest.secret_sha256
        kept = len(expected) - len(self.manifest.tables) - (SECRET in expected)
        if kept != self.manifest.file_count:
            raise self._refused(f"it holds {kept} of {self.manifest.file_count} files")
        for name, sha256 in expected.items():
            with self.open(name) as stream:
                if sha256_of(stream) != sha256:
                    raise self._refused(f"{name} does not have the bytes it was made with")
            told(1)

    def _header(self) -> Header:
        content = self._json(HEADER)
        if content.get("format") != FORMAT:
            raise self._refused(
                f"its format is {content.get('format')}, this version reads {FORMAT}; "
                "use the version of Quaymark that made it, or a newer one"
            )
        return Header(**content)

    def _manifest(self) -> Manifest:
        content = self._json(MANIFEST)
        tables = [TableEntry(**table) for table in content.pop("tables")]
        jobs = [JobEntry(**job) for job in content.pop("jobs")]
        return Manifest(tables=tables, jobs=jobs, **content)

    def _json(self, name: str) -> dict[str, Any]:
        try:
            content: dict[str, Any] = json.loads(self.read(name))
        except ValueError as error:
            raise self._refused(f"{name} cannot be read") from error
        return content

    def _refused(self, why: str) -> Invalid:
        return Invalid(f"{self._path} cannot be restored: {why}")


def as_json(entry: Header | Manifest) -> dict[str, Any]:
    """Return what is written of a header or a manifest."""
    return asdict(entry)


def sha256_of(stream: IO[bytes]) -> str:
    """Return the SHA-256 of what is left of a stream."""
    digest = hashlib.sha256()
    while chunk := stream.read(CHUNK_BYTES):
        digest.update(chunk)
    return digest.hexdigest()
