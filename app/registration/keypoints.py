"""Replacing a viewport's keypoints, all or none.

Landmarks belong to the site: the same name is the same point in every viewport. So a place that
differs from the known one is most likely a slip, and is refused unless moving it is asked for.
"""

from collections.abc import Container, Mapping, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session
from sqlalchemy.orm.attributes import flag_modified
from sqlalchemy.orm.exc import StaleDataError

from app.errors import Conflict, FieldError, Invalid, PreconditionFailed
from app.registration import repository
from app.registration.places import Place, is_there, require_near
from app.registration.schemas import KeypointIn, KeypointsIn
from app.tables.registration import Keypoint, Landmark
from app.tables.sites import Camera, Viewport


def replace(session: Session, viewport: Viewport, data: KeypointsIn) -> Sequence[Keypoint]:
    """Make `data` the viewport's keypoints. Raises Invalid naming each wrong one."""
    site = viewport.camera.site
    known = repository.landmarks(session, site.id)
    by_name = {landmark.name: landmark for landmark in known}
    by_id = {landmark.id: landmark for landmark in known}
    wrong: list[FieldError] = []
    chosen: dict[str, tuple[Landmark, KeypointIn]] = {}
    for index, point in enumerate(data.keypoints):
        try:
            _check_inside(point, viewport.camera)
            place = point.place(site.water_level_m)
            if place is not None:
                require_near(site, place)
            landmark = _landmark(point, place, site.id, by_name, by_id, moves=data.update_landmarks)
            _check_new(landmark.name, chosen)
        except ValueError as error:
            wrong.append(FieldError(f"keypoints.{index}", str(error)))
        else:
            chosen[landmark.name] = (landmark, point)
    if wrong:
        raise Invalid(f"{wrong[0].field}: {wrong[0].message}", fields=tuple(wrong))
    _store(session, viewport, list(chosen.values()))
    return repository.keypoints(session, viewport.id)


def _check_new(name: str, chosen: Container[str]) -> None:
    if name in chosen:
        raise ValueError(f"name {name!r} is there twice; keep one of them")


def _check_inside(point: KeypointIn, camera: Camera) -> None:
    inside_u = -0.5 <= point.u_px <= camera.width_px - 0.5
    inside_v = -0.5 <= point.v_px <= camera.height_px - 0.5
    if not (inside_u and inside_v):
        raise ValueError(
            f"(u_px, v_px) = ({point.u_px}, {point.v_px}) lies outside the image of "
            f"{camera.width_px} x {camera.height_px} px"
        )


def _landmark(
    point: KeypointIn,
    place: Place | None,
    site_id: int,
    by_name: Mapping[str, Landmark],
    by_id: Mapping[int, Landmark],
    *,
    moves: bool,
) -> Landmark:
    landmark = _known(point, by_name, by_id)
    if landmark is None:
        if place is None or point.name is None:
            raise ValueError(
                f"landmark {point.name!r} is new here; give its lat_deg, lon_deg and height_m"
            )
        lat_deg, lon_deg, height_m = place
        return Landmark(
            site_id=site_id, name=point.name, lat_deg=lat_deg, lon_deg=lon_deg, height_m=height_m
        )
    if place is not None and not is_there(landmark, place):
        if not moves:
            raise ValueError(
                f"landmark {landmark.name!r} is known at {landmark.lat_deg}, {landmark.lon_deg}, "
                f"{landmark.height_m} m; use that place, another name, or update_landmarks: true "
                "to move it"
            )
        landmark.lat_deg, landmark.lon_deg, landmark.height_m = place
    return landmark


def _known(
    point: KeypointIn, by_name: Mapping[str, Landmark], by_id: Mapping[int, Landmark]
) -> Landmark | None:
    if point.landmark_id is None:
        return by_name.get(point.name or "")
    landmark = by_id.get(point.landmark_id)
    if landmark is None:
        raise ValueError(f"there is no landmark {point.landmark_id} on this site")
    if point.name not in {None, landmark.name}:
        raise ValueError(f"landmark {landmark.id} is named {landmark.name!r}, not {point.name!r}")
    return landmark


def _store(
    session: Session, viewport: Viewport, chosen: Sequence[tuple[Landmark, KeypointIn]]
) -> None:
    try:
        session.add_all(landmark for landmark, _ in chosen)
        session.flush()
        before = {point.landmark_id: point for point in repository.keypoints(session, viewport.id)}
        for landmark, point in chosen:
            keypoint = before.pop(landmark.id, None)
            if keypoint is None:
                keypoint = Keypoint(viewport_id=viewport.id, landmark_id=landmark.id)
                session.add(keypoint)
            keypoint.u_px, keypoint.v_px, keypoint.role = point.u_px, point.v_px, point.role
        for keypoint in before.values():
            session.delete(keypoint)
        # The set belongs to the viewport: replacing it is an edit of the viewport.
        flag_modified(viewport, "name")
        session.flush()
    except sa.exc.IntegrityError as error:
        raise Conflict("somebody else adds the same landmarks just now; try again") from error
    except StaleDataError as error:
        raise PreconditionFailed(
            "somebody else changed the keypoints meanwhile; read them again, then repeat the edit"
        ) from error
