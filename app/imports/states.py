"""What may happen to a batch, in one table: from this status, by this act, to that status."""

from enum import StrEnum

from app.errors import Conflict
from app.tables.imports import ImportStatus


class Act(StrEnum):
    """What people do with a batch."""

    ADD = "add files to"
    COMMIT = "commit"
    DISCARD = "discard"
    UNDO = "undo"
    RESTORE = "restore"
    MOVE = "move"


S = ImportStatus
TRANSITIONS: dict[tuple[ImportStatus, Act], ImportStatus] = {
    (S.COLLECTING, Act.ADD): S.COLLECTING,
    (S.COLLECTING, Act.MOVE): S.COLLECTING,
    (S.COLLECTING, Act.COMMIT): S.COMMITTED,
    (S.COLLECTING, Act.DISCARD): S.DISCARDED,
    (S.COMMITTED, Act.MOVE): S.COMMITTED,
    (S.COMMITTED, Act.UNDO): S.UNDONE,
    (S.UNDONE, Act.RESTORE): S.COMMITTED,
}


def after(status: ImportStatus, act: Act) -> ImportStatus:
    """Return the status an act leads to. Raises Conflict where it is not possible."""
    following = TRANSITIONS.get((status, act))
    if following is None and status in {to for (_, by), to in TRANSITIONS.items() if by is act}:
        raise Conflict(f"the import is {status.value} already")
    if following is None:
        raise Conflict(f"you cannot {act.value} an import that is {status.value}")
    return following


def acts(status: ImportStatus) -> list[Act]:
    """Return what may be done with a batch of a status."""
    return [act for before, act in TRANSITIONS if before is status]
