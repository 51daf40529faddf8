"""From an editor's keypoints to what the solve preview needs, read from the database."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.domain.geodesy import Geodetic
from app.errors import FieldError, Invalid
from app.registration import conversion, repository
from app.registration.places import require_near
from app.registration.preview import EditedPoint, KnownLandmark, Preview
from app.registration.preview_schemas import SolveIn, SolveKeypointIn
from app.tables.registration import Keypoint, Landmark
from app.tables.sites import Site, Viewport


def preview_of(session: Session, viewport: Viewport, asked: SolveIn) -> Preview:
    """Gather what there is to solve. Raises Invalid naming each keypoint without a place."""
    site = viewport.camera.site
    landmarks = repository.landmarks(session, site.id)
    if asked.keypoints is None:
        points = [_stored(point) for point in repository.keypoints(session, viewport.id)]
    else:
        points = _edited(site, landmarks, asked.keypoints)
    return Preview(
        frame=conversion.frame_of(site),
        water_level_m=site.water_level_m,
        intrinsics=conversion.intrinsics_of(viewport.camera),
        points=points,
        landmarks=[KnownLandmark(one.id, one.name, _place(one)) for one in landmarks],
    )


def _stored(point: Keypoint) -> EditedPoint:
    return EditedPoint(
        key=str(point.id),
        name=point.landmark.name,
        landmark_id=point.landmark_id,
        place=_place(point.landmark),
        u_px=point.u_px,
        v_px=point.v_px,
        role=point.role,
    )


def _edited(
    site: Site, landmarks: Sequence[Landmark], points: Sequence[SolveKeypointIn]
) -> list[EditedPoint]:
    by_id = {landmark.id: landmark for landmark in landmarks}
    by_name = {landmark.name: landmark for landmark in landmarks}
    found: list[EditedPoint] = []
    wrong: list[FieldError] = []
    for index, point in enumerate(points):
        known = by_name.get(point.name or "")
        if point.landmark_id is not None:
            known = by_id.get(point.landmark_id)
        try:
            place = _edited_place(site, point, known)
        except ValueError as error:
            wrong.append(FieldError(f"keypoints.{index}", str(error)))
            continue
        found.append(
            EditedPoint(
                key=point.key or str(index),
                name=point.name or (known.name if known else ""),
                landmark_id=known.id if known else None,
                place=place,
                u_px=point.u_px,
                v_px=point.v_px,
                role=point.role,
            )
        )
    if wrong:
        raise Invalid(f"{wrong[0].field}: {wrong[0].message}", fields=tuple(wrong))
    return found


def _edited_place(site: Site, point: SolveKeypointIn, known: Landmark | None) -> Geodetic:
    place = point.place(site.water_level_m)
    if place is not None:
        require_near(site, place)
        return Geodetic(*place)
    if known is None:
        raise ValueError(
            "give its lat_deg, lon_deg and height_m, or the landmark_id of a known one"
        )
    return _place(known)


def _place(landmark: Landmark) -> Geodetic:
    return Geodetic(landmark.lat_deg, landmark.lon_deg, landmark.height_m)
