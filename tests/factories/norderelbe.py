"""The published viewport of the Norderelbe as a site: its camera, photographs, AIS and weights."""

import json
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from sqlalchemy.orm import Session

from app.db import Database
from app.domain.geodesy import EnuFrame, Geodetic
from app.storage import Storage
from app.tables.ais import AisPosition, AisStatic
from app.tables.detection import Model, ModelStatus
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.registration import Registration, RegistrationMethod
from app.tables.sites import Camera
from tests.factories.sites import make_camera, make_site, make_viewport

IMAGE = "00139255c1d7dd9c"
MMSI = 211234560
CAPTURED_AT = datetime(2022, 7, 14, 10, 20, 30, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Published:
    """The files of the published sample, read."""

    camera: dict[str, Any]
    label: dict[str, Any]
    photograph: bytes
    weights: bytes

    @classmethod
    def read(cls, shared: Path) -> "Published":
        """Read the files below the shared folder."""
        bonk = shared / "real" / "bonk"
        return cls(
            camera=json.loads((bonk / "camera.json").read_text()),
            label=json.loads((bonk / "label" / f"{IMAGE}.json").read_text()),
            photograph=(bonk / "image" / f"{IMAGE}.jpg").read_bytes(),
            weights=(shared / "models" / "yolox_nano.onnx").read_bytes(),
        )

    @property
    def origin(self) -> Geodetic:
        """The place below the camera, on the ellipsoid."""
        return Geodetic(self.camera["center_lat_deg"], self.camera["center_lon_deg"], 0.0)

    def rotation_cam_from_enu(self) -> list[float]:
        """Return the Rodrigues vector of the camera in the ENU frame at the origin."""
        rotation = (
            np.array(self.camera["R_cam_from_ecef"]) @ EnuFrame(self.origin).R_enu_from_ecef.T
        )
        rotvec, _ = cv2.Rodrigues(rotation)
        return [float(x) for x in rotvec.ravel()]


def make_norderelbe(
    database: Database, storage: Storage, published: Published, image_count: int
) -> tuple[int, str]:
    """Store the site with copies of its photograph a minute apart, each with its AIS report.

    Returns the viewport's id and the detector's name. Every copy differs in its bytes, so that
    every one is detected, and shows the same pixels.
    """
    storage.put(published.weights)
    with database.writing() as session:
        camera = _camera(session, published)
        viewport = make_viewport(session, camera, "south")
        _register(session, viewport.id, published)
        for number in range(image_count):
            moment = CAPTURED_AT + timedelta(minutes=number)
            copy = published.photograph + number.to_bytes(4, "big")
            stored = storage.put(copy)
            session.add(
                Image(
                    site_id=camera.site_id,
                    camera_id=camera.id,
                    viewport_id=viewport.id,
                    sha256=stored.sha256,
                    media_type="image/jpeg",
                    file_name=f"{number:05}.jpg",
                    size_bytes=stored.size_bytes,
                    width_px=camera.width_px,
                    height_px=camera.height_px,
                    captured_at=moment,
                    captured_at_source=CaptureTimeSource.GIVEN,
                )
            )
            hear(session, published, moment)
        model = Model(
            name="yolox-nano",
            family="yolox",
            sha256=storage.put(published.weights).sha256,
            size_bytes=len(published.weights),
            status=ModelStatus.READY,
        )
        session.add(model)
        session.flush()
        return viewport.id, model.name


def _camera(session: Session, published: Published) -> Camera:
    origin, K = published.origin, published.camera["K"]
    site = make_site(
        session,
        "Norderelbe",
        origin_lat_deg=origin.lat_deg,
        origin_lon_deg=origin.lon_deg,
        origin_height_m=0.0,
        water_level_m=0.0,
    )
    return make_camera(
        session,
        site,
        "Kehrwieder",
        width_px=published.camera["width"],
        height_px=published.camera["height"],
        fx_px=K[0][0],
        fy_px=K[1][1],
        cx_px=K[0][2],
        cy_px=K[1][2],
    )


def _register(session: Session, viewport_id: int, published: Published) -> None:
    camera, K = published.camera, published.camera["K"]
    session.add(
        Registration(
            viewport_id=viewport_id,
            method=RegistrationMethod.GIVEN,
            rotation=published.rotation_cam_from_enu(),
            center_lat_deg=camera["center_lat_deg"],
            center_lon_deg=camera["center_lon_deg"],
            center_height_m=camera["center_height_m"],
            intrinsics={
                "width_px": camera["width"],
                "height_px": camera["height"],
                "fx_px": K[0][0],
                "fy_px": K[1][1],
                "cx_px": K[0][2],
                "cy_px": K[1][2],
                "distortion": [0.0] * 5,
            },
        )
    )


def hear(session: Session, published: Published, captured_at: datetime) -> None:
    """Insert the vessel's reports as they were heard before a photograph of this moment."""
    vessel = published.label["vessels"][0]
    heard_at = captured_at - timedelta(seconds=vessel["secondsSinceLastPositionReport"])
    size = vessel["size"]
    session.add(
        AisPosition(
            mmsi=MMSI,
            fix_time=heard_at,
            received_at=heard_at,
            fix_time_source="stated",
            lat_deg=vessel["lat"],
            lon_deg=vessel["long"],
            sog_kn=vessel["speed"],
            cog_deg=vessel["heading"],
            heading_deg=vessel["heading"],
            message_type=1,
            ais_class="A",
        )
    )
    session.add(
        AisStatic(
            mmsi=MMSI,
            received_at=heard_at,
            name="HARBOUR FERRY",
            to_bow_m=size["to_bow"],
            to_stern_m=size["to_stern"],
            to_port_m=size["to_port"],
            to_starboard_m=size["to_starboard"],
        )
    )
