"""What every archive holds besides its format's own files: a manifest and a datasheet.

They come last, because what they count is known when all else is written.
"""

from collections.abc import Iterable, Iterator

from app.exports.writers.datasheet import datasheet
from app.exports.writers.json_bytes import sorted_json
from app.exports.writers.records import Source
from app.exports.writers.zip_stream import Member, zip_stream

MANIFEST, DATASHEET = "manifest.json", "README.md"


def packed(source: Source, members: Iterable[Member]) -> Iterator[bytes]:
    """Give the bytes of an archive with a format's files, its manifest and its datasheet."""
    return zip_stream(_with_papers(source, members))


def _with_papers(source: Source, members: Iterable[Member]) -> Iterator[Member]:
    yield from members
    manifest = source.manifest()
    yield MANIFEST, sorted_json(manifest, indent=True) + b"\n"
    yield DATASHEET, datasheet(manifest).encode()
