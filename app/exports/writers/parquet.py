"""GeoParquet 1.1: one pose a row, its place as a point that maps understand.

`geometry` is the middle of the box as WKB (longitude, latitude; OGC:CRS84). The manifest stands in
the file's metadata. pyarrow is loaded only where a file is written.
"""

import json
import struct
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any

from app.exports.writers.flat import COLUMNS, NUMBER, WHOLE, Cell, row
from app.exports.writers.json_bytes import ascii_json
from app.exports.writers.records import PoseRecord, Source

if TYPE_CHECKING:
    import pyarrow as pa

ROWS_AT_ONCE = 10_000
GEOMETRY = "geometry"
_POINT = struct.Struct("<BIdd")
_WKB_POINT = 1


def write(source: Source) -> Iterator[bytes]:
    """Give the file in chunks, a row group at a time."""
    import pyarrow as pa  # noqa: PLC0415 - large, and only here
    import pyarrow.parquet as pq  # noqa: PLC0415

    schema = _schema(pa, source)
    sink = _Sink()
    poses = source.poses()
    with pq.ParquetWriter(sink, schema, compression="zstd") as writer:
        while some := list(islice(poses, ROWS_AT_ONCE)):
            writer.write_batch(_batch(pa, schema, some))
            yield sink.taken()
    yield sink.taken()


def _schema(pa: Any, source: Source) -> "pa.Schema":  # noqa: ANN401  a module
    types = {WHOLE: pa.int64(), NUMBER: pa.float64()}
    fields = [pa.field(name, types.get(kind, pa.string())) for name, kind in COLUMNS.items()]
    metadata = {
        "geo": json.dumps(_geo(), sort_keys=True),
        "quaymark": ascii_json(source.manifest()),
    }
    return pa.schema([*fields, pa.field(GEOMETRY, pa.binary())], metadata=metadata)


def _geo() -> dict[str, object]:
    from pyproj import CRS  # noqa: PLC0415 - only here

    column = {
        "encoding": "WKB",
        "geometry_types": ["Point"],
        "crs": CRS.from_user_input("OGC:CRS84").to_json_dict(),
    }
    return {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}


def _batch(pa: Any, schema: "pa.Schema", poses: list[PoseRecord]) -> "pa.RecordBatch":  # noqa: ANN401  a module
    columns: list[tuple[Cell | bytes, ...]] = list(zip(*map(row, poses), strict=True))
    columns.append(tuple(_POINT.pack(1, _WKB_POINT, pose.lon_deg, pose.lat_deg) for pose in poses))
    arrays = [pa.array(values, field.type) for values, field in zip(columns, schema, strict=True)]
    return pa.record_batch(arrays, schema=schema)


class _Sink:
    """Takes what pyarrow writes until it is fetched."""

    closed = False

    def __init__(self) -> None:
        self._chunks: list[bytes] = []
        self._position = 0

    def write(self, data: Any) -> int:  # noqa: ANN401  a buffer
        chunk = bytes(data)
        self._chunks.append(chunk)
        self._position += len(chunk)
        return len(chunk)

    def tell(self) -> int:
        return self._position

    def flush(self) -> None:
        """Nothing waits here."""

    def writable(self) -> bool:
        return True

    def readable(self) -> bool:
        return False

    def seekable(self) -> bool:
        return False

    def close(self) -> None:
        """Leave what is written to be fetched."""

    def taken(self) -> bytes:
        data = b"".join(self._chunks)
        self._chunks.clear()
        return data
