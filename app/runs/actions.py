"""What callers do with runs that take a permission and leave an audit line."""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.deletions import actions as deletions
from app.runs import service
from app.tables.runs import Run


def run_for(session: Session, access: Access, scope: Scope, run_id: int) -> Run:
    """Return a run on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    run = service.get_run(session, run_id)
    access.require(scope, run.site_id)
    return run


def delete_run(session: Session, access: Access, run: Run) -> None:
    """Delete a run with its poses and reviews, for 30 days."""
    deletions.delete(session, access, "run", run.id, run.site_id, service.label(run))
