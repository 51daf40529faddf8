"""Viewports as the pages list them: with keypoints, registration, images and the next step."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.imagery import service as imagery
from app.imagery.span import ImageSpan
from app.registration import service
from app.registration.readiness import Quality, Readiness, quality_of, readiness_of
from app.tables.registration import Registration
from app.tables.sites import Viewport

NO_IMAGES = ImageSpan(0, None, None)


@dataclass(frozen=True, slots=True)
class ViewportLine:
    """A viewport with what is known of it."""

    viewport: Viewport
    keypoint_count: int
    registration: Registration | None
    quality: Quality | None
    images: ImageSpan
    readiness: Readiness


def lines_of(session: Session, viewports: Sequence[Viewport]) -> list[ViewportLine]:
    """Gather what the pages say of viewports, in a few queries for all."""
    ids = [viewport.id for viewport in viewports]
    keypoints = service.keypoint_counts(session, ids)
    registrations = service.current_registrations(session, ids)
    images = imagery.spans_of_viewports(session, ids)
    return [
        _line(
            viewport,
            keypoints.get(viewport.id, 0),
            registrations.get(viewport.id),
            images.get(viewport.id, NO_IMAGES),
        )
        for viewport in viewports
    ]


def _line(
    viewport: Viewport, keypoint_count: int, registration: Registration | None, images: ImageSpan
) -> ViewportLine:
    return ViewportLine(
        viewport=viewport,
        keypoint_count=keypoint_count,
        registration=registration,
        quality=quality_of(registration) if registration else None,
        images=images,
        readiness=readiness_of(viewport, keypoint_count, registration, images.count),
    )
