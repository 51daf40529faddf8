"""A run can be named its site's reference: new runs are compared with it unless others are named.

There is one for a site. Naming another one replaces it, and each change is a version, so that two
people who choose at once do not undo each other's choice.
"""

from sqlalchemy.orm import Session

from app.auth.access import Access
from app.auth.audit import record
from app.db import now
from app.errors import Invalid, PreconditionFailed
from app.runs import reference_repository as repository
from app.runs import repository as runs
from app.tables.runs import ReferenceRun, Run

NONE_YET = 0  # the version of a site that never had one


def version(session: Session, site_id: int) -> int:
    """Return the version of a site's choice."""
    chosen = repository.of_site(session, site_id)
    return NONE_YET if chosen is None else chosen.version


def check_version(session: Session, site_id: int, shown: int) -> None:
    """Compare the version a page was shown with. Raises PreconditionFailed for an older one."""
    repository.lock_site(session, site_id)
    if shown != version(session, site_id):
        raise PreconditionFailed(
            "somebody chose another reference run meanwhile; go back to the run and look again"
        )


def reference_of(session: Session, site_id: int) -> Run | None:
    """Return a site's reference run; None where there is none, or where it was deleted."""
    (run_id,) = repository.run_ids(session, [site_id]) or (None,)
    return None if run_id is None else runs.get(session, run_id)


def choose(session: Session, access: Access, site_id: int, run_id: int | None) -> None:
    """Name a run the reference of its site, or take the name back (None), and say so in the audit.

    Raises Invalid naming `run_id` for a run of another site.
    """
    if run_id is not None:
        run = runs.get(session, run_id)
        if run is None or run.site_id != site_id:
            raise Invalid.field("run_id", f"is no run of site {site_id}")
    chosen = repository.of_site(session, site_id)
    if chosen is None:
        chosen = ReferenceRun(site_id=site_id)
        session.add(chosen)
    before = chosen.run_id
    chosen.run_id, chosen.chosen_at, chosen.chosen_by_id = run_id, now(), access.user_id
    session.flush()
    record(session, access, "choose", "reference run", run_id, site_id=site_id, instead_of=before)
