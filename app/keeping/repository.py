"""SQL over all tables: which files they refer to, whether there is anything in them."""

from collections.abc import Iterator, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.detectors.service import IMPORTED_FAMILY
from app.tables.ais import AisFile
from app.tables.ais_uploads import AisUpload
from app.tables.calibration import CalibrationPhoto
from app.tables.detection import Model
from app.tables.exports import Export
from app.tables.imagery import Image
from app.tables.imports import FileState, ImportFile
from app.tables.operation import FileFinding, FileProblem
from app.tables.runs import Run, RunImage

# Every column that names a file of the store; a test looks for forgotten ones.
FILE_COLUMNS: tuple[InstrumentedAttribute[Any], ...] = (
    Image.sha256,
    AisFile.sha256,
    AisUpload.sha256,
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
        if column is not ImportFile.sha256 and column is not Model.sha256
    ]
    # Boxes of another detector are rows: of their file nothing but its hash is kept.
    detector = Model.family != IMPORTED_FAMILY
    parts.append(sa.select(Model.sha256).where(Model.sha256.is_not(None), detector))
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


def findings(session: Session) -> dict[str, FileProblem]:
    """Return the files that were found not to be whole."""
    rows = session.execute(sa.select(FileFinding.sha256, FileFinding.problem))
    return {row.sha256: row.problem for row in rows}


def keep_finding(session: Session, sha256: str, problem: FileProblem | None) -> None:
    """Keep what is wrong with a file; with None forget it."""
    session.execute(sa.delete(FileFinding).where(FileFinding.sha256 == sha256))
    if problem is not None:
        session.add(FileFinding(sha256=sha256, problem=problem))


def accountings(connection: sa.Connection) -> list[tuple[int, str, dict[str, Any]]]:
    """Return (id, name, what became of its lines) of each recording."""
    rows = connection.execute(sa.select(AisFile.id, AisFile.file_name, AisFile.accounting))
    return [(row.id, row.file_name, row.accounting) for row in rows]


def runs_miscounted(connection: sa.Connection) -> list[tuple[int, int, int]]:
    """Return (id, images announced, images there) of each run whose numbers differ."""
    there = sa.func.count(RunImage.image_id)
    rows = connection.execute(
        sa.select(Run.id, Run.image_count, there)
        .outerjoin(RunImage, RunImage.run_id == Run.id)
        .group_by(Run.id)
        .having(Run.image_count != there)
    )
    return [(row[0], row[1], row[2]) for row in rows]
