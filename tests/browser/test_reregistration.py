"""A proposed pointing in the browser: flick between before and after, and accept it."""

from datetime import UTC, datetime
from typing import NamedTuple

import httpx2
import pytest
import sqlalchemy as sa
from playwright.sync_api import Page, expect

from app.db import now
from app.reregistration.schemas import ReregistrationIn
from app.tables.imagery import Image
from app.tables.reregistration import (
    Pointing,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)
from tests.browser.conftest import Installation
from tests.browser.registrable import HEIGHT_PX, WIDTH_PX, make_registrable
from tests.factories.imagery import photograph

TURN_RAD = 0.01
SINCE = datetime(2026, 6, 2, 12, tzinfo=UTC)


class Proposed(NamedTuple):
    """Ids of a pointing that waits, and of the viewport it is turned from."""

    pointing_id: int
    viewport_id: int


@pytest.fixture
def proposed(api: httpx2.Client, installation: Installation) -> Proposed:
    """Give a registered viewport and a later photograph found to be turned by 0.57 degree."""
    trial = make_registrable(api, 12)
    path = f"/viewports/{trial.viewport_id}"
    answer = api.post(f"{path}/registrations", json={"method": "pnp"})
    assert answer.status_code == 201, answer.text
    registration_id = int(answer.json()["id"])
    camera_id = int(api.get(path).json()["camera_id"])
    answer = api.post(
        "/images",
        data={"camera_id": str(camera_id), "captured_at": f"{SINCE:%Y-%m-%dT%H:%M:%SZ}"},
        files={
            "file": ("turned.png", photograph(1000 + trial.seed, WIDTH_PX, HEIGHT_PX, kind="PNG"))
        },
    )
    assert answer.status_code == 201, answer.text
    image_id = int(answer.json()["id"])
    turn = {
        "rotation_from_reference": [0.0, TURN_RAD, 0.0],
        "covariance": [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-7]],
        "angle_deg": 0.573,
    }
    with installation.database.writing() as session:
        first = session.scalars(
            sa.select(Image).where(Image.camera_id == camera_id).order_by(Image.captured_at)
        ).first()
        assert first is not None
        job = Reregistration(
            site_id=trial.site_id,
            viewport_id=trial.viewport_id,
            registration_id=registration_id,
            reference_image_id=first.id,
            settings=ReregistrationIn().model_dump(mode="json", by_alias=True),
            status=ReregistrationStatus.SUCCEEDED,
            workflow_id=f"flick-{trial.viewport_id}",
            image_count=1,
            started_at=now(),
            finished_at=now(),
        )
        session.add(job)
        session.flush()
        pointing = Pointing(
            reregistration_id=job.id,
            position=0,
            first_at=SINCE,
            last_at=SINCE,
            image_count=1,
            **turn,
        )
        session.add(pointing)
        session.flush()
        session.add(
            ReregistrationImage(
                reregistration_id=job.id,
                image_id=image_id,
                position=0,
                pointing_id=pointing.id,
                inliers=120,
                hull_share=0.4,
                rmse_px=1.5,
                keyframe_ids=[first.id],
                attempts=1,
                done_at=now(),
                **turn,
            )
        )
        session.flush()
        return Proposed(pointing.id, trial.viewport_id)


def test_a_pointing_is_flicked_and_accepted(page: Page, proposed: Proposed) -> None:
    """B changes the pose drawn, Space only while held, keys rest while typing; accepting works.

    With the turn a landmark lies elsewhere, by the angle times the focal length; the turned
    reference photograph can be laid over the new one.
    """
    page.goto(f"/pointings/{proposed.pointing_id}")
    flick = page.locator("[data-flick]")
    before = page.get_by_role("button", name="Before", exact=True)
    after = page.get_by_role("button", name="After", exact=True)
    expect(after).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".flick__name")).to_have_count(12)
    turned_px = name_x(page, "Mark 06")
    page.keyboard.press("b")
    expect(before).to_have_attribute("aria-pressed", "true")
    assert abs(turned_px - name_x(page, "Mark 06")) == pytest.approx(8 * zoom(page), rel=0.1)
    page.keyboard.press("b")
    page.locator("[data-flick-view]").focus()
    page.keyboard.down("Space")
    expect(flick).to_have_attribute("data-shows", "before")
    page.keyboard.up("Space")
    expect(flick).to_have_attribute("data-shows", "after")
    page.get_by_label("Difference").check()
    reference = page.locator(".flick__reference")
    expect(reference).to_have_css("opacity", "1")
    expect(reference).to_have_css("mix-blend-mode", "difference")
    page.wait_for_function("() => document.querySelector('.flick__reference').naturalWidth > 0")
    page.get_by_label("Name of the viewport").press_sequentially("Turned b")
    expect(after).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Accept").click()
    expect(page.get_by_role("heading", name="Turned b")).to_be_visible()
    assert page.url.rsplit("/", 1)[1] != str(proposed.viewport_id)


def name_x(page: Page, name: str) -> float:
    """Return where a landmark's name is drawn, CSS pixels from the left."""
    return float(page.locator(".flick__name", has_text=name).get_attribute("x") or "nan")


def zoom(page: Page) -> float:
    """Return the CSS pixels per pixel of the photograph."""
    return float(
        page.locator(".viewer__image").first.evaluate(
            "(image) => image.getBoundingClientRect().width / image.offsetWidth"
        )
    )
