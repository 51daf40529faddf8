"""A registered viewport with images, and a re-registration whose images have had their turn."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import pytest

from app.db import Database, now
from app.reregistration.schemas import ReregistrationIn
from app.tables.registration import Registration, RegistrationMethod
from app.tables.reregistration import (
    Pointing,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)
from tests.factories.imagery import make_image
from tests.factories.sites import make_camera, make_site, make_viewport
from tests.factories.world import INTRINSICS

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)
HOUR = timedelta(hours=1)


@dataclass(frozen=True)
class Turned:
    """Ids of what there is; pointings: unmoved at 13 h, turned by 0.57 degree at 15 and 16 h."""

    camera_id: int
    viewport_id: int
    registration_id: int
    image_ids: list[int]
    reregistration_id: int
    unmoved_id: int
    moved_id: int


@pytest.fixture
def turned(database: Database) -> Turned:
    """Give a viewport valid until 12:30, and four later images that a job has looked at."""
    with database.writing() as session:
        site = make_site(session, "Elbe")
        camera = make_camera(session, site, "Roof", **INTRINSICS)
        viewport = make_viewport(session, camera, "North", valid_until=NOON + HOUR / 2)
        registration = Registration(
            viewport_id=viewport.id,
            method=RegistrationMethod.GIVEN,
            rotation=[1.2, 0.1, -0.1],
            center_lat_deg=53.54,
            center_lon_deg=9.98,
            center_height_m=70.0,
            intrinsics=INTRINSICS,
        )
        session.add(registration)
        session.flush()
        images = [
            make_image(session, camera, viewport if hour == 0 else None, NOON + hour * HOUR)
            for hour in (0, 1, 3, 4, 5)
        ]
        job = Reregistration(
            site_id=site.id,
            viewport_id=viewport.id,
            registration_id=registration.id,
            reference_image_id=images[0].id,
            settings=ReregistrationIn().model_dump(mode="json", by_alias=True),
            status=ReregistrationStatus.SUCCEEDED,
            workflow_id="reregister-1",
            image_count=4,
            started_at=now(),
            finished_at=now(),
        )
        session.add(job)
        session.flush()
        pointings = [
            Pointing(
                reregistration_id=job.id,
                position=position,
                rotation_from_reference=rotation,
                angle_deg=angle_deg,
                covariance=[[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-7]],
                first_at=images[first].captured_at,
                last_at=images[last].captured_at,
                image_count=last - first + 1,
            )
            for position, (rotation, angle_deg, first, last) in enumerate(
                [([0.0, 0.0002, 0.0], 0.0115, 1, 1), ([0.0, 0.01, 0.0], 0.573, 2, 3)]
            )
        ]
        session.add_all(pointings)
        session.flush()
        for position, (image, pointing) in enumerate(
            zip(images[1:], [pointings[0], pointings[1], pointings[1], None], strict=True)
        ):
            session.add(
                ReregistrationImage(
                    reregistration_id=job.id,
                    image_id=image.id,
                    position=position,
                    pointing_id=pointing and pointing.id,
                    refusal=None if pointing else "too_few_inliers",
                    message=None if pointing else "Too few points of the known scenery found again",
                    rotation_from_reference=pointing and pointing.rotation_from_reference,
                    covariance=pointing and pointing.covariance,
                    angle_deg=pointing and pointing.angle_deg,
                    inliers=120 + position if pointing else 6,
                    hull_share=0.4,
                    rmse_px=1.5,
                    keyframe_ids=[images[0].id],
                    attempts=1,
                    done_at=now(),
                )
            )
        session.flush()
        return Turned(
            camera.id,
            viewport.id,
            registration.id,
            [image.id for image in images],
            job.id,
            pointings[0].id,
            pointings[1].id,
        )
