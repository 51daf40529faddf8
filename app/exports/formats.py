"""The formats by name: what writes them, and what a downloaded file is called and served as."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from app.exports.filters import ExportOptions
from app.exports.writers import bonk, bop, coco, kitti, ndjson, parquet, table_csv
from app.exports.writers.archive import packed
from app.exports.writers.records import Source
from app.exports.writers.zip_stream import Member

ZIP = ("application/zip", "zip")
IMAGE_FOLDER = "images/"


def _nothing(_: Source) -> Iterator[bytes]:
    """Write no single file: the format is a folder."""
    return iter(())


@dataclass(frozen=True, slots=True)
class Format:
    """A format: one file (`write`), or the files of an archive (`members`)."""

    name: str
    label: str
    media_type: str
    suffix: str
    write: Callable[[Source], Iterator[bytes]] = _nothing
    members: Callable[[Source], Iterator[Member]] | None = None


FORMATS = {
    form.name: form
    for form in (
        Format("coco", "COCO", "application/json", "json", write=coco.write),
        Format("bop", "BOP", *ZIP, members=bop.members),
        Format("kitti", "KITTI 3D", *ZIP, members=kitti.members),
        Format("bonk", "BONK-pose", *ZIP, members=bonk.members),
        Format("parquet", "GeoParquet", "application/vnd.apache.parquet", "parquet", parquet.write),
        Format("ndjson", "NDJSON", "application/x-ndjson", "ndjson", write=ndjson.write),
        Format("csv", "CSV", "text/csv; charset=utf-8", "csv", write=table_csv.write),
    )
}
MEDIA_TYPES = sorted({form.media_type.partition(";")[0] for form in FORMATS.values()} | {ZIP[0]})


def is_archive(format_name: str, options: ExportOptions) -> bool:
    """Whether an export is a zip archive."""
    return FORMATS[format_name].members is not None or options.archive or options.images


def file_kind(format_name: str, options: ExportOptions) -> tuple[str, str]:
    """Return the media type and the suffix of an export's file."""
    form = FORMATS[format_name]
    return ZIP if is_archive(format_name, options) else (form.media_type, form.suffix)


def written(format_name: str, options: ExportOptions, source: Source) -> Iterator[bytes]:
    """Give an export's bytes."""
    form = FORMATS[format_name]
    if form.members is not None:
        return packed(source, form.members(source))
    if not is_archive(format_name, options):
        return form.write(source)
    write = form.write
    if format_name == "coco" and options.images:
        write = partial(coco.write, folder=IMAGE_FOLDER)
    return packed(source, _files(source, write, form.suffix))


def _files(
    source: Source, write: Callable[[Source], Iterator[bytes]], suffix: str
) -> Iterator[Member]:
    """Give a file for each part, and each photograph once."""
    for part in source.parts:
        yield f"{part}.{suffix}", write(source.part(part))
    if not source.parts:
        yield f"poses.{suffix}", write(source)
    for image in source.images():
        photograph = source.photograph(image)
        if photograph is None:
            return
        yield f"{IMAGE_FOLDER}{image.sha256}{image.suffix}", photograph
