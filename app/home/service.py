"""What the first page says: how far the installation is, and what there is left to review."""

from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.home import repository
from app.home.checklist import NOTHING, Checklist, checklist
from app.reviews import queues
from app.reviews import service as reviews
from app.runs import service as runs
from app.tables.sites import Site

RUNS_LOOKED_AT = 20


@dataclass(frozen=True, slots=True)
class Continued:
    """Where a reviewer goes on: what it is, what is left, and whether they were there before."""

    title: str
    href: str
    left: int
    done: int
    unit: str


def first_steps(session: Session, access: Access) -> tuple[Site | None, Checklist]:
    """Return the site that is being set up (None: no site yet) and how far it is."""
    site = repository.site_to_set_up(session, access.site_ids(Scope.INGEST))
    facts = NOTHING if site is None else repository.facts_of(session, site.id)
    return site, checklist(site, facts)


def work_left(session: Session, access: Access) -> Continued | None:
    """Return where a person's reviewing goes on: their last queue, else the newest ungraded run."""
    site_ids = access.site_ids(Scope.REVIEW)
    for queue in repository.queues_of(session, access.user_id, site_ids):
        counts = queues.counts(session, [queue], access.user_id)[queue.id]
        return Continued(
            f"{runs.label(queue.run)}, {queues.describe(queue)}",
            f"/runs/{queue.run_id}/review?queue={queue.id}",
            counts.total - counts.done,
            counts.done,
            f"{queue.unit.value}s",
        )
    newest = [run for run, _ in runs.newest_runs(session, site_ids, RUNS_LOOKED_AT)]
    verdicts = reviews.verdicts_by_run(session, [run.id for run in newest])
    for run in newest:
        judged = verdicts[run.id]
        if judged.poses > judged.graded:
            return Continued(
                runs.label(run),
                f"/runs/{run.id}/review",
                judged.poses - judged.graded,
                judged.graded,
                "poses",
            )
    return None
