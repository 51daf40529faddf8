"""SQL over all tables: which files they refer to, whether there is anything in them."""

from collections.abc import Iterator, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute

from app.tables.ais import AisFile
from app.tables.calibration import CalibrationPhoto
from app.tables.detection import Model
from app.tables.exports import Export
from app.tables.imagery import Image
from app.tables.imports import FileState, ImportFile

# Every column that names a file of the store; a test looks for forgotten ones.
FILE_COLUMNS: tuple[InstrumentedAttribute[Any], ...] = (
    Image.sha256,
    AisFile.sha256,
    Model.sha256,
    CalibrationPhoto.sha256,
    Export.sha256,
    ImportFile.sha256,
)


def referenced_files(connection: sa.Connection) -> Iterator[str]:
    """Give the SHA-256 of every file that some row refers to, each once, in order."""
    parts = [
        sa.select(column.label("sha256")).where(column.is_not(None))
        for column in FILE_COLUMNS
        if column is not ImportFile.sha256
    ]
    # Of a batch on its way in, other files are known by their bytes and not kept.
    staged = ImportFile.state == FileState.STAGED
    parts.append(sa.select(ImportFile.sha256).where(ImportFile.sha256.is_not(None), staged))
    found = sa.union(*parts).subquery()
    for (sha256,) in connection.execute(sa.select(found.c.sha256).order_by(found.c.sha256)):
        yield sha256


def first_filled(connection: sa.Connection, tables: Sequence[sa.Table]) -> str | None:
    """Return the name of a table that has rows, or None where all of them are empty or missing."""
    present = frozenset(sa.inspect(connection).get_table_names())
    for table in tables:
        if table.name in present:
            statement = sa.select(sa.literal(1)).select_from(sa.table(table.name)).limit(1)
            if connection.execute(statement).first() is not None:
                return table.name
    return None
