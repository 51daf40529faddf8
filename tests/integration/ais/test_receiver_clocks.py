"""A receiver whose clock is off: both times are kept, and no image is matched by them."""

from datetime import timedelta

import pytest
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.ais.live import Arrived, store_reports
from app.db import Database
from app.domain.ais import PositionReport
from app.domain.candidates import UnmatchedReason
from app.domain.detection import Detection
from app.domain.fusion import FusionResult, fuse
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import Geodetic
from app.domain.plausibility import Doubt
from app.tables.feeds import AisFeed, FeedKind
from tests.factories.afloat import look_north
from tests.factories.ais import MMSI, NOON, make_static
from tests.factories.runs import Harbour, make_harbour
from worker.tasks.vessel_states import states_around

HALF_A_MINUTE = timedelta(seconds=30)
SETTINGS = FusionSettings(preset=Preset.WATERLINE)


def hear(session: Session, harbour: Harbour, late: timedelta) -> None:
    """Store a vessel's minute before the camera, from noon on, of a receiver that is so late."""
    _, frame = look_north(session, harbour)
    place = frame.geodetic([0.0, 300.0, 0.0])
    feed = AisFeed(
        site_id=harbour.site.id,
        name=f"{late} late",
        kind=FeedKind.TCP,
        host="192.0.2.7",
        port=5631,
        silent_after_s=60.0,
    )
    session.add(feed)
    session.flush()
    moments = [NOON + timedelta(seconds=second) for second in range(0, 70, 10)]
    reports = [
        PositionReport(
            *(MMSI, moment - late, moment - late, place.lat_deg, place.lon_deg),
            *(0.0, None, 91.0, None, 1, "A", True),
        )
        for moment in moments
    ]
    arrived = map(Arrived, reports, moments)
    store_reports(session, harbour.site.id, feed.id, list(arrived))
    make_static(session, None, NOON - timedelta(days=9))


def fused(session: Session, harbour: Harbour, after: timedelta) -> FusionResult:
    """Fuse an image so long after noon, with a detection where the vessel is."""
    camera, frame = look_north(session, harbour)
    at: Geodetic = frame.geodetic(camera.center_in_world)
    (states,) = states_around(session, harbour.site.id, at, {1: NOON + after}, SETTINGS).values()
    boxes = []
    for state in states:
        assert (Doubt.RECEIVER_CLOCK in state.flags) == state.is_withheld
        x1, y1, x2, y2 = camera.project(
            frame.position(state.lat_deg, state.lon_deg, 0.0)[None] + [[-10, 0, 0], [10, 0, 8]]
        ).ravel()
        boxes.append(Detection(x1, y2, x2, y1, 0.9, 8))
    return fuse(camera, frame, 0.0, boxes, states, SETTINGS)


@pytest.mark.parametrize("late", [timedelta(hours=48), timedelta(hours=-48), timedelta(minutes=30)])
def test_what_a_wrong_receiver_heard_is_kept_and_matched_with_nothing(
    database: Database, client: TestClient, late: timedelta
) -> None:
    """Images of when it says and of when it came show the vessel, withheld; both times are told."""
    with database.writing() as session:
        harbour = make_harbour(session)
        hear(session, harbour, late)
        for after in (HALF_A_MINUTE, HALF_A_MINUTE - late):
            result = fused(session, harbour, after)
            assert result.poses == []
            assert result.unmatched_states == {0: UnmatchedReason.CLOCK_SUSPECT}
        assert fused(session, harbour, HALF_A_MINUTE - 3 * late).unmatched_states == {}
    (first, *_) = client.get("/api/v1/ais/positions").json()["items"]
    assert "receiver_clock" in first["doubts"]
    assert first["received_at"] != first["arrived_at"] == "2024-05-01T12:00:00Z"


@pytest.mark.parametrize("late", [timedelta(minutes=3), timedelta(seconds=-20)])
def test_another_receiver_and_a_slow_line_count(database: Database, late: timedelta) -> None:
    """Lines some minutes late are no wrong clock's; what a right receiver heard is matched."""
    with database.writing() as session:
        harbour = make_harbour(session)
        hear(session, harbour, late)
        assert len(fused(session, harbour, HALF_A_MINUTE - late).poses) == 1
        hear(session, harbour, timedelta(days=2))
        assert len(fused(session, harbour, HALF_A_MINUTE - late).poses) == 1
