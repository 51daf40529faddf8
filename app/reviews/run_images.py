"""The images of a run as a reviewer goes through them, with and without poses.

An image is complete when a person said that every visible vessel is accounted for: each pose is
graded, and each vessel without one is marked as missed with its reason.
"""

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.errors import Invalid, NotFound
from app.reviews import image_repository as repository
from app.tables.runs import Run


def run_over(session: Session, access: Access, scope: Scope, run_id: int, image_id: int) -> Run:
    """Return a run that is over an image. Raises NotFound, Forbidden, Invalid naming `run_id`."""
    image = repository.image(session, image_id)
    if image is None:
        raise NotFound("there is no such image")
    access.require(scope, image.site_id)
    run = repository.run_over(session, run_id, image_id)
    if run is None:
        raise Invalid.field("run_id", "is not the id of a run over this image")
    return run
