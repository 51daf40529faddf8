"""What callers do with deletions: the permission, the change and the audit line together."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import service
from app.errors import Forbidden
from app.tables.deletion import Deletion

# Who may delete something, and so bring it back.
SCOPES = {
    "site": Scope.ADMIN,
    "camera": Scope.REGISTER,
    "viewport": Scope.REGISTER,
    "run": Scope.INGEST,
    "import": Scope.INGEST,
    "image": Scope.INGEST,
    "ais_file": Scope.INGEST,
    "calibration_set": Scope.INGEST,
    "comment": Scope.REVIEW,
    "feed": Scope.INGEST,
    "ground_truth_file": Scope.INGEST,
    "landmark": Scope.REGISTER,
    "missed_vessel": Scope.REVIEW,
    "model": Scope.INGEST,
    "retention_rule": Scope.ADMIN,
    "review_queue": Scope.REVIEW,
    "standing_run": Scope.INGEST,
    "watched_folder": Scope.INGEST,
    "water_levels": Scope.REGISTER,
}
# What a person made for themselves or said is brought back by them, or by an administrator.
PERSONAL = frozenset({"comment", "review_queue"})


def delete(
    session: Session, access: Access, entity: str, row_id: int, site_id: int | None, label: str
) -> Deletion:
    """Hide a site, camera, viewport, run, image or recording with all that belongs to it."""
    access.require(SCOPES[entity], site_id)
    deletion = service.delete(
        session, entity, [row_id], site_id=site_id, label=label, user_id=access.user_id
    )
    record(session, access, "delete", entity, row_id, site_id, name=label, counts=deletion.counts)
    return deletion


def deletion_for(session: Session, access: Access, deletion_id: int) -> Deletion:
    """Return a deletion on a site the caller may read. Raises NotFound."""
    deletion = service.get_deletion(session, deletion_id)
    access.require(Scope.READ, deletion.site_id)
    return deletion


def may_restore(access: Access, deletion: Deletion) -> bool:
    """Whether somebody may bring back what a deletion took."""
    if deletion.entity in PERSONAL and deletion.deleted_by_id != access.user_id:
        return access.may(Scope.ADMIN, deletion.site_id)
    return access.may(SCOPES[deletion.entity], deletion.site_id)


def restore(session: Session, access: Access, deletion_id: int) -> None:
    """Bring back what a deletion took. Raises NotFound, Forbidden, Conflict."""
    deletion = deletion_for(session, access, deletion_id)
    access.require(SCOPES[deletion.entity], deletion.site_id)
    if not may_restore(access, deletion):
        raise Forbidden("only who deleted it or an administrator brings it back")
    entity, entity_id, label = deletion.entity, deletion.entity_id, deletion.label
    site_id = deletion.site_id
    service.restore(session, deletion)
    record(session, access, "restore", entity, entity_id, site_id, name=label)
