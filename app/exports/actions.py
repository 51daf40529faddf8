"""What callers do with exports under way: permission, change and audit line together."""

from app.auth.access import Access
from app.auth.audit import record
from app.db import Database
from app.exports import service
from app.exports.rights import own_export
from app.jobs import JobClient
from app.tables.exports import Export


def cancel(database: Database, jobs: JobClient, access: Access, export_id: int) -> Export:
    """Stop a caller's export. Raises NotFound, and Conflict for one that has ended."""
    with database.reading() as session:
        export = own_export(session, access, export_id)
        service.refuse_ended(export)
    # Before any row is written here: the job engine writes on a connection of its own.
    jobs.cancel(export.workflow_id)
    with database.writing() as session:
        service.mark_cancelled(session, export_id)
        record(session, access, "cancel", "export", export_id)
    with database.reading() as session:
        return service.get_export(session, export_id)
