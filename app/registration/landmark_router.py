"""REST of landmarks, and of landmarks and keypoints as CSV and GeoJSON."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, etag, set_etag
from app.dependencies import Page, PagingDep, SessionDep
from app.domain.coordinates import Axis, parse_angle, parse_place
from app.errors import Invalid, TooLarge
from app.openapi_bodies import file_answer, json_body, text_body
from app.registration import actions, conversion, landmarks, service
from app.registration.geojson import MEDIA_TYPE, parse_geojson, write_geojson
from app.registration.keypoint_csv import (
    COLUMNS,
    LANDMARK_COLUMNS,
    parse_landmarks,
    parse_table,
    write_table,
)
from app.registration.landmark_schemas import (
    ImportedOut,
    LandmarkIn,
    LandmarkOut,
    LandmarkPatch,
    PlaceOut,
)
from app.registration.places import require_near
from app.registration.schemas import MOST_KEYPOINTS, KeypointIn, KeypointOut, KeypointsIn
from app.sites import actions as sites
from app.sites.fields import HIGHEST_M, HeightDatum
from app.tables.registration import Landmark
from app.tables.sites import Site, Viewport

router = APIRouter(tags=["landmarks"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]
MOST_BYTES = 1_000_000
MOST_LANDMARKS = 5000
Moves = Annotated[bool, Query(description="Move known landmarks to the places given here")]


async def _text(request: Request) -> str:
    """Read the body as text, no more of it than a table may have."""
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MOST_BYTES:
            raise TooLarge(f"a table has at most {MOST_BYTES} bytes")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Invalid.field("body", "is no text in UTF-8; save it as CSV UTF-8") from error


Text = Annotated[str, Depends(_text)]
_LANDMARK = "name,lat_deg,lon_deg,height_m\nChurch spire,53.5448,9.9921,62.4\n"
_KEYPOINT = (
    "name,u_px,v_px,lat_deg,lon_deg,height_m\nChurch spire,812.5,301.0,53.5448,9.9921,62.4\n"
)
_POINT = {"type": "Point", "coordinates": [9.9921, 53.5448, 62.4]}


def _collection(**properties: object) -> dict[str, Any]:
    feature = {"type": "Feature", "geometry": _POINT, "properties": properties}
    return {"type": "FeatureCollection", "features": [feature]}


LANDMARKS_CSV = text_body("text/csv", _LANDMARK)
KEYPOINTS_CSV = text_body("text/csv", _KEYPOINT)
LANDMARKS_GEOJSON = json_body(MEDIA_TYPE, _collection(name="Church spire"))
KEYPOINTS_GEOJSON = json_body(MEDIA_TYPE, _collection(name="Church spire", u_px=812.5, v_px=301.0))
AS_CSV: Any = {"response_class": Response, "responses": file_answer("text/csv")}
AS_GEOJSON: Any = {"response_class": Response, "responses": file_answer(MEDIA_TYPE)}


@router.get("/sites/{site_id:int}/landmarks")
def list_landmarks(
    site_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[LandmarkOut]:
    """List a site's landmarks."""
    site = sites.site_for(session, access, Scope.READ, site_id)
    found, next_cursor = landmarks.listed(session, site.id, paging)
    return Page(items=_shown(session, site, found), next_cursor=next_cursor)


@router.post("/sites/{site_id:int}/landmarks", status_code=201)
def create_landmark(
    site_id: int, data: LandmarkIn, session: SessionDep, access: Registrar, response: Response
) -> LandmarkOut:
    """Make a landmark; coordinates as numbers or as text, the height above ellipsoid or water."""
    site = sites.site_for(session, access, Scope.REGISTER, site_id)
    landmark = landmarks.create(session, access, site, data)
    set_etag(response, landmark.version)
    response.headers["Location"] = f"/api/v1/landmarks/{landmark.id}"
    return _shown(session, site, [landmark])[0]


@router.get("/landmarks/{landmark_id:int}")
def get_landmark(
    landmark_id: int, session: SessionDep, access: Reader, response: Response
) -> LandmarkOut:
    """Show a landmark; its ETag is what an edit sends as If-Match."""
    landmark, site = landmarks.landmark_for(session, access, Scope.READ, landmark_id)
    set_etag(response, landmark.version)
    return _shown(session, site, [landmark])[0]


@router.patch("/landmarks/{landmark_id:int}", dependencies=[VERSIONED])
def update_landmark(
    landmark_id: int,
    data: LandmarkPatch,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
) -> LandmarkOut:
    """Change a landmark, for all viewports that see it."""
    landmark, site = landmarks.landmark_for(session, access, Scope.REGISTER, landmark_id)
    check_if_match(request, landmark.version)
    landmarks.update(session, access, landmark, site, data)
    set_etag(response, landmark.version)
    return _shown(session, site, [landmark])[0]


@router.delete("/landmarks/{landmark_id:int}", status_code=204, dependencies=[VERSIONED])
def delete_landmark(
    landmark_id: int, request: Request, session: SessionDep, access: Registrar
) -> None:
    """Delete a landmark that no viewport uses; it can be restored for 30 days."""
    landmark, _ = landmarks.landmark_for(session, access, Scope.REGISTER, landmark_id)
    if "if-match" in request.headers:
        check_if_match(request, landmark.version)
    landmarks.delete(session, access, landmark)


@router.get("/sites/{site_id:int}/landmarks.csv", **AS_CSV)
def landmarks_as_csv(site_id: int, session: SessionDep, access: Reader) -> Response:
    """Return a site's landmarks as CSV."""
    rows = _landmark_rows(session, access, site_id)
    return Response(write_table(rows, LANDMARK_COLUMNS), media_type="text/csv")


@router.get("/sites/{site_id:int}/landmarks.geojson", **AS_GEOJSON)
def landmarks_as_geojson(site_id: int, session: SessionDep, access: Reader) -> Response:
    """Return a site's landmarks as GeoJSON."""
    rows = _landmark_rows(session, access, site_id)
    return Response(write_geojson(rows, LANDMARK_COLUMNS), media_type=MEDIA_TYPE)


@router.post("/sites/{site_id:int}/landmarks.csv", openapi_extra=LANDMARKS_CSV)
def import_landmarks_csv(
    site_id: int, text: Text, session: SessionDep, access: Registrar, *, update: Moves = False
) -> ImportedOut:
    """Make the landmarks of a CSV table, all or none."""
    site = sites.site_for(session, access, Scope.REGISTER, site_id)
    return _brought_in(session, access, site, parse_landmarks(text), moves=update)


@router.post("/sites/{site_id:int}/landmarks.geojson", openapi_extra=LANDMARKS_GEOJSON)
def import_landmarks_geojson(
    site_id: int, text: Text, session: SessionDep, access: Registrar, *, update: Moves = False
) -> ImportedOut:
    """Make the landmarks of a GeoJSON collection, all or none."""
    site = sites.site_for(session, access, Scope.REGISTER, site_id)
    rows = parse_geojson(text, LandmarkIn, LANDMARK_COLUMNS)
    return _brought_in(session, access, site, rows, moves=update)


@router.get("/viewports/{viewport_id:int}/keypoints.csv", **AS_CSV)
def keypoints_as_csv(viewport_id: int, session: SessionDep, access: Reader) -> Response:
    """Return a viewport's keypoints as CSV; the ETag is the viewport's."""
    rows, version = _keypoint_rows(session, access, viewport_id)
    return Response(write_table(rows), media_type="text/csv", headers={"ETag": etag(version)})


@router.get(
    "/viewports/{viewport_id:int}/keypoints.geojson",
    **AS_GEOJSON,
)
def keypoints_as_geojson(viewport_id: int, session: SessionDep, access: Reader) -> Response:
    """Return a viewport's keypoints as GeoJSON; the ETag is the viewport's."""
    rows, version = _keypoint_rows(session, access, viewport_id)
    headers = {"ETag": etag(version)}
    return Response(write_geojson(rows, COLUMNS), media_type=MEDIA_TYPE, headers=headers)


@router.put("/viewports/{viewport_id:int}/keypoints.csv", openapi_extra=KEYPOINTS_CSV)
def replace_keypoints_csv(
    viewport_id: int,
    text: Text,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
    *,
    update: Moves = False,
) -> Page[KeypointOut]:
    """Replace all keypoints by a CSV table."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    rows = parse_table(text)
    return _replaced(session, access, viewport, rows, request, response, moves=update)


@router.put("/viewports/{viewport_id:int}/keypoints.geojson", openapi_extra=KEYPOINTS_GEOJSON)
def replace_keypoints_geojson(
    viewport_id: int,
    text: Text,
    request: Request,
    session: SessionDep,
    access: Registrar,
    response: Response,
    *,
    update: Moves = False,
) -> Page[KeypointOut]:
    """Replace all keypoints by a GeoJSON collection."""
    viewport = actions.viewport_for(session, access, Scope.REGISTER, viewport_id)
    rows = parse_geojson(text, KeypointIn, COLUMNS)
    return _replaced(session, access, viewport, rows, request, response, moves=update)


@router.get("/sites/{site_id:int}/place")
def understand_place(
    site_id: int,
    session: SessionDep,
    access: Reader,
    lat: Annotated[str, Query(max_length=120, description="Decimal or DMS, or both in one")] = "",
    lon: Annotated[str | None, Query(max_length=120, description="Decimal or DMS")] = None,
    height_m: Annotated[float, Query(ge=-HIGHEST_M, le=HIGHEST_M)] = 0.0,
    height_datum: HeightDatum = HeightDatum.ELLIPSOID,
) -> PlaceOut:
    """Understand a place as it is typed: in degrees, and in the site's frame."""
    site = sites.site_for(session, access, Scope.READ, site_id)
    field = "lat_deg"
    try:
        if lon is None:
            lat_deg, lon_deg = parse_place(lat)
        else:
            lat_deg = parse_angle(lat, Axis.LATITUDE)
            field = "lon_deg"
            lon_deg = parse_angle(lon, Axis.LONGITUDE)
        field = "lat_deg"
        height = height_datum.ellipsoidal(height_m, site.water_level_m)
        require_near(site, (lat_deg, lon_deg, height))
    except ValueError as error:
        raise Invalid.field(field, str(error)) from error
    enu_m = conversion.frame_of(site).position(lat_deg, lon_deg, height)
    return PlaceOut(
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        height_m=height,
        enu_m=enu_m.tolist(),
        distance_m=float(np.linalg.norm(enu_m)),
    )


def _shown(session: Session, site: Site, found: Sequence[Landmark]) -> list[LandmarkOut]:
    counts = landmarks.viewport_counts(session, found)
    return [LandmarkOut.of(one, site.water_level_m, counts.get(one.id, 0)) for one in found]


def _landmark_rows(session: Session, access: Access, site_id: int) -> list[dict[str, Any]]:
    site = sites.site_for(session, access, Scope.READ, site_id)
    return [
        {column: getattr(landmark, column) for column in LANDMARK_COLUMNS}
        for landmark in landmarks.all_of(session, site.id)
    ]


def _brought_in(
    session: Session, access: Access, site: Site, rows: list[LandmarkIn], *, moves: bool
) -> ImportedOut:
    if len(rows) > MOST_LANDMARKS:
        raise Invalid.field("table", f"has {len(rows)} landmarks; at most {MOST_LANDMARKS}")
    return ImportedOut(**asdict(landmarks.bring_in(session, access, site, rows, moves=moves)))


def _keypoint_rows(
    session: Session, access: Access, viewport_id: int
) -> tuple[list[dict[str, Any]], int]:
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    keypoints = service.keypoints_of(session, viewport.id)
    rows = [KeypointOut.of(point).model_dump(mode="json") for point in keypoints]
    return rows, viewport.version


def _replaced(
    session: Session,
    access: Access,
    viewport: Viewport,
    rows: list[KeypointIn],
    request: Request,
    response: Response,
    *,
    moves: bool,
) -> Page[KeypointOut]:
    if len(rows) > MOST_KEYPOINTS:
        raise Invalid.field("table", f"has {len(rows)} keypoints; at most {MOST_KEYPOINTS}")
    if "if-match" in request.headers or service.keypoints_of(session, viewport.id):
        check_if_match(request, viewport.version)
    data = KeypointsIn(keypoints=rows, update_landmarks=moves)
    keypoints = actions.replace_keypoints(session, access, viewport, data)
    set_etag(response, viewport.version)
    return Page(items=[KeypointOut.of(keypoint) for keypoint in keypoints])
