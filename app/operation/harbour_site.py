"""The demo harbour as a site: what a person would upload, put in through the same services.

Every part is looked for before it is made, so that an interrupted start is simply continued.
"""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from sqlalchemy.orm import Session

from app.ais.service import import_ais_file
from app.config import Settings
from app.db import Database
from app.detectors.imported import import_coco_detections
from app.domain.arrays import FloatArray, UInt8Array
from app.imagery.service import Upload, store_image
from app.jobs import JobClient
from app.operation import harbour_repository as repository
from app.registration import service as registration
from app.registration.schemas import KeypointIn, KeypointsIn, RegistrationIn, ViewportIn
from app.runs.service import start_run
from app.simulation import harbour as simulation
from app.simulation.truth import VesselTruth as SimulatedTruth
from app.simulation.viewports import Viewport as SimulatedViewport
from app.sites import service as sites
from app.sites.schemas import CameraIn, SiteIn
from app.storage import Storage
from app.tables.groundtruth import VesselClass, VesselTruth
from app.tables.sites import Camera, Site, Viewport

SEED = 1
IMAGE_COUNT = 24
DETECTOR = "harbour detections"
JPEG_QUALITY = 90


class Tell(Protocol):
    """Shows a person what is going on; what is fleeting is only shown where it can be replaced."""

    def __call__(self, text: str, *, fleeting: bool = False) -> None:
        """Show a line."""


@dataclass(frozen=True, slots=True)
class HarbourSite:
    """The demo harbour's rows."""

    site_id: int
    camera_id: int
    viewport_ids: Sequence[int]


def find_complete(database: Database) -> HarbourSite | None:
    """Return the demo harbour when all of it is there."""
    with database.reading() as session:
        site = repository.simulated_site(session)
        camera = repository.first_camera(session, site.id) if site else None
        if site is None or camera is None or not repository.has_detector(session, DETECTOR):
            return None
        viewports = repository.viewports(session, camera.id)
        return HarbourSite(site.id, camera.id, [viewport.id for viewport in viewports])


def install(database: Database, storage: Storage, settings: Settings, tell: Tell) -> HarbourSite:
    """Render the harbour and store it: site, camera, viewports, images, AIS, detections, truth."""
    tell("Building the demo harbour ...")
    harbour = simulation.make_harbour(SEED, image_count=IMAGE_COUNT)
    with database.writing() as session:
        site = _site(session, harbour)
        camera = _camera(session, site, harbour)
    viewport_ids = [
        _viewport(database, camera.id, harbour, viewport) for viewport in harbour.camera.viewports
    ]
    image_ids: dict[int, int] = {}
    for frame in harbour.frames:
        tell(f"Rendering image {frame.image_id} of {len(harbour.frames)} ...", fleeting=True)
        seen = frame.observe()
        upload = Upload(_jpeg(seen.image), frame.name, frame.captured_at)
        image, _ = store_image(database, storage, settings, camera.id, upload)
        image_ids[frame.image_id] = image.id
        with database.writing() as session:
            rows = [_truth_row(image.id, truth) for truth in seen.truth]
            repository.replace_truth(session, image.id, rows)
    recording = io.BytesIO(harbour.nmea_text().encode())
    import_ais_file(database, storage, recording, site_id=site.id, file_name="harbour.nmea")
    _import_detections(database, camera.id, harbour, image_ids)
    return HarbourSite(site.id, camera.id, viewport_ids)


def start_missing_runs(database: Database, jobs: JobClient, place: HarbourSite) -> list[int]:
    """Start a run on each viewport that has none; returns the newest run of each viewport."""
    run_ids = []
    for viewport_id in place.viewport_ids:
        with database.writing() as session:
            run_id = repository.newest_run(session, viewport_id)
            if run_id is None:
                viewport = session.get_one(Viewport, viewport_id)
                run_id = start_run(
                    session,
                    jobs,
                    viewport_id=viewport_id,
                    detector=DETECTOR,
                    preset="paper",
                    parameters={},
                    name=f"Demo, {viewport.name}",
                ).id
            run_ids.append(run_id)
    return run_ids


def _site(session: Session, harbour: simulation.Harbour) -> Site:
    known = repository.simulated_site(session)
    if known is not None:
        return known
    origin = harbour.site.origin
    return sites.create_site(
        session,
        SiteIn.model_validate(
            {
                "name": harbour.site.name,
                "origin": {
                    "lat_deg": origin.lat_deg,
                    "lon_deg": origin.lon_deg,
                    "height_m": origin.height_m,
                },
                "water_level_m": harbour.site.water_level_m,
                "timezone": harbour.site.timezone,
                "is_simulated": True,
            }
        ),
    )


def _camera(session: Session, site: Site, harbour: simulation.Harbour) -> Camera:
    known = repository.first_camera(session, site.id)
    if known is not None:
        return known
    intrinsics = harbour.camera.intrinsics
    return sites.create_camera(
        session,
        CameraIn.model_validate(
            {
                "site_id": site.id,
                "name": harbour.camera.name,
                "width_px": intrinsics.width_px,
                "height_px": intrinsics.height_px,
                "K": intrinsics.K.tolist(),
                "distortion": intrinsics.distortion.tolist(),
                "timezone": "UTC",
            }
        ),
    )


def _viewport(
    database: Database,
    camera_id: int,
    harbour: simulation.Harbour,
    simulated: SimulatedViewport,
) -> int:
    with database.writing() as session:
        known = repository.viewports(session, camera_id)
        viewport = next((one for one in known if one.name == simulated.name), None)
        if viewport is None:
            viewport = registration.create_viewport(
                session,
                ViewportIn(
                    camera_id=camera_id,
                    name=simulated.name,
                    valid_from=simulated.valid_from,
                    valid_until=simulated.valid_until,
                ),
            )
        places = {landmark.name: landmark.place for landmark in harbour.landmarks}
        keypoints = [
            KeypointIn(
                name=seen.landmark,
                lat_deg=places[seen.landmark].lat_deg,
                lon_deg=places[seen.landmark].lon_deg,
                height_m=places[seen.landmark].height_m,
                u_px=seen.u_px,
                v_px=seen.v_px,
            )
            for seen in simulated.keypoints
        ]
        registration.replace_keypoints(session, viewport, KeypointsIn(keypoints=keypoints))
        registered = registration.newest_by_method(session, viewport.id)
    if not registered:
        for method in ("homography_water", "homography_pca", "pnp"):
            asked = RegistrationIn.model_validate({"method": method})
            registration.register(database, viewport.id, asked)
    return viewport.id


def _jpeg(image_bgr: UInt8Array) -> bytes:
    _, encoded = cv2.imencode(".jpg", image_bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return encoded.tobytes()


def _truth_row(image_id: int, truth: SimulatedTruth) -> VesselTruth:
    box = truth.box_px or truth.whole_box_px
    return VesselTruth(
        image_id=image_id,
        identifier=truth.identifier,
        mmsi=truth.mmsi,
        vessel_class=VesselClass(truth.class_name.value),
        centroid_in_cam_m=truth.centroid_in_cam_m.tolist(),
        rotvec_cam_from_vessel=truth.rotvec_cam_from_vessel.tolist(),
        length_m=truth.length_m,
        width_m=truth.width_m,
        height_m=truth.height_m,
        corners_in_image_px=_pixels(truth.corners_in_image_px),
        visible_fraction=truth.visible_fraction,
        x1_px=box[0],
        y1_px=box[1],
        x2_px=box[2],
        y2_px=box[3],
    )


def _pixels(points_px: FloatArray) -> list[list[float] | None]:
    return [None if np.isnan(point).any() else [float(x) for x in point] for point in points_px]


def _import_detections(
    database: Database, camera_id: int, harbour: simulation.Harbour, image_ids: dict[int, int]
) -> None:
    results = [
        {**result, "image_id": image_ids[int(str(result["image_id"]))]}
        for result in harbour.coco_results()
    ]
    listed = {
        "images": [
            {"id": image_ids[frame.image_id], "file_name": frame.name} for frame in harbour.frames
        ]
    }
    import_coco_detections(
        database,
        json.dumps(results).encode(),
        name=DETECTOR,
        camera_id=camera_id,
        images=json.dumps(listed).encode(),
    )
