"""Boxes on their way out, as a COCO file of a site or of one file that came in."""

from typing import Any

from sqlalchemy.orm import Session

from app.groundtruth import repository
from app.groundtruth.coco_document import coco_document


def document_of(session: Session, site_id: int, file_id: int | None = None) -> dict[str, Any]:
    """Return a site's ground truth as a COCO document, or that of one file of the site."""
    return coco_document(*repository.all_of(session, site_id, file_id))
