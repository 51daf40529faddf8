"""What a run's end tells the webhooks of its site."""

from sqlalchemy.orm import Session

from app.tables.runs import Run
from app.tables.webhooks import WebhookEvent
from app.webhooks.outbox import announce


def announce_end(session: Session, run_id: int) -> None:
    """Note for the site's webhooks that a run has ended, in the transaction that ends it."""
    run = session.get_one(Run, run_id, populate_existing=True)
    data = {
        "run_id": run.id,
        "site_id": run.site_id,
        "name": run.name,
        "images": run.image_count,
        "status": run.status.value,
        "error": run.error,
        "url": f"/api/v1/runs/{run.id}",
    }
    announce(session, WebhookEvent.RUN_FINISHED, {run.site_id}, data)
