"""A site's landmarks: made, moved, removed, and brought in as a table, all of it or none.

A landmark is one point for all viewports of its site, so moving it moves their keypoints too; their
registrations stay as they were solved.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.auth.audit import record
from app.deletions import service as deletions
from app.edits import flush_named
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.paging import Paging
from app.registration import repository
from app.registration.landmark_schemas import LandmarkIn, LandmarkPatch
from app.registration.places import Place, is_there, require_near
from app.sites import service as sites
from app.tables.registration import Landmark
from app.tables.sites import Site


@dataclass(frozen=True, slots=True)
class Imported:
    """How many landmarks of a table were new, moved or as they were."""

    created: int
    moved: int
    unchanged: int


def landmark_for(
    session: Session, access: Access, scope: Scope, landmark_id: int
) -> tuple[Landmark, Site]:
    """Return a landmark, and its site on which the caller holds a scope. Raises NotFound."""
    landmark = get(session, landmark_id)
    access.require(scope, landmark.site_id)
    return landmark, sites.get_site(session, landmark.site_id)


def get(session: Session, landmark_id: int) -> Landmark:
    """Return a landmark. Raises NotFound."""
    landmark = repository.landmark(session, landmark_id)
    if landmark is None:
        raise NotFound("there is no such landmark")
    return landmark


def all_of(session: Session, site_id: int) -> Sequence[Landmark]:
    """Return all landmarks of a site."""
    return repository.landmarks(session, site_id)


def listed(session: Session, site_id: int, paging: Paging) -> tuple[Sequence[Landmark], str | None]:
    """Return a page of a site's landmarks."""
    return repository.landmark_page(session, site_id, paging)


def viewport_counts(session: Session, landmarks: Sequence[Landmark]) -> dict[int, int]:
    """Count the viewports that see each landmark."""
    return repository.keypoint_counts_of_landmarks(session, [one.id for one in landmarks])


def create(session: Session, access: Access, site: Site, data: LandmarkIn) -> Landmark:
    """Make a landmark. Raises Conflict for a taken name, Invalid for a place too far away."""
    place = data.place(site.water_level_m)
    _require_near(site, place)
    landmark = Landmark(
        site_id=site.id, name=data.name, lat_deg=place[0], lon_deg=place[1], height_m=place[2]
    )
    session.add(landmark)
    _flush(session, landmark.name)
    record(session, access, "create", "landmark", landmark.id, site.id, name=landmark.name)
    return landmark


def update(
    session: Session, access: Access, landmark: Landmark, site: Site, data: LandmarkPatch
) -> Landmark:
    """Change a landmark. Raises as `create`."""
    changes = data.model_dump(exclude_none=True, exclude={"height_datum"})
    if data.height_m is not None:
        changes["height_m"] = data.height_datum.ellipsoidal(data.height_m, site.water_level_m)
    for field, value in changes.items():
        setattr(landmark, field, value)
    _require_near(site, (landmark.lat_deg, landmark.lon_deg, landmark.height_m))
    _flush(session, landmark.name)
    record(session, access, "update", "landmark", landmark.id, site.id, changes=changes)
    return landmark


def delete(session: Session, access: Access, landmark: Landmark) -> None:
    """Delete a landmark for 30 days. Raises Conflict while a viewport uses it."""
    names = repository.viewport_names_of_landmark(session, landmark.id)
    if names:
        listed_names = ", ".join(repr(name) for name in names)
        raise Conflict(f"viewport {listed_names} has a keypoint of it; remove that one first")
    record(session, access, "delete", "landmark", landmark.id, landmark.site_id, name=landmark.name)
    deletions.delete(
        session,
        "landmark",
        [landmark.id],
        site_id=landmark.site_id,
        label=landmark.name,
        user_id=access.user_id,
    )


def bring_in(
    session: Session, access: Access, site: Site, rows: Sequence[LandmarkIn], *, moves: bool
) -> Imported:
    """Make the landmarks of a table; known ones may stand elsewhere only if `moves`.

    Raises Invalid naming each wrong row; then nothing is changed.
    """
    by_name = {landmark.name: landmark for landmark in repository.landmarks(session, site.id)}
    wrong: list[FieldError] = []
    places: dict[str, Place] = {}
    for index, row in enumerate(rows):
        place, known = row.place(site.water_level_m), by_name.get(row.name)
        reason = _refusal(site, row.name, place, None if moves else known, places)
        if reason is not None:
            wrong.append(FieldError(f"landmarks.{index}", reason))
        places[row.name] = place
    if wrong:
        raise Invalid(f"{wrong[0].field}: {wrong[0].message}", fields=tuple(wrong))
    created = moved = 0
    for name, place in places.items():
        landmark = by_name.get(name)
        if landmark is None:
            landmark = Landmark(site_id=site.id, name=name)
            session.add(landmark)
            created += 1
        elif is_there(landmark, place):
            continue
        else:
            moved += 1
        landmark.lat_deg, landmark.lon_deg, landmark.height_m = place
    _flush(session, "one of them")
    counts = Imported(created, moved, len(places) - created - moved)
    record(
        session,
        access,
        "import",
        "landmarks",
        site.id,
        site.id,
        created=counts.created,
        moved=counts.moved,
    )
    return counts


def _refusal(
    site: Site, name: str, place: Place, fixed: Landmark | None, earlier: Container[str]
) -> str | None:
    """Say why a row cannot be taken; `fixed` is the landmark it must not move."""
    if name in earlier:
        return f"name {name!r} is there twice; keep one of them"
    if fixed is not None and not is_there(fixed, place):
        return (
            f"landmark {name!r} is known at {fixed.lat_deg}, {fixed.lon_deg}, {fixed.height_m} m; "
            "use that place, another name, or update=true to move it"
        )
    try:
        require_near(site, place)
    except ValueError as error:
        return str(error)
    return None


def _require_near(site: Site, place: tuple[float, float, float]) -> None:
    try:
        require_near(site, place)
    except ValueError as error:
        raise Invalid.field("lat_deg", str(error)) from error


def _flush(session: Session, name: str) -> None:
    flush_named(session, f"this site already has a landmark named {name!r}")
