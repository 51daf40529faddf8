"""What is hard to believe of stored positions, and of the vessel states made from them."""

from datetime import timedelta

from starlette.testclient import TestClient

from app.ais.doubts import doubts_between, doubts_of
from app.db import Database
from app.domain.fusion_settings import FusionSettings, Preset
from app.domain.geodesy import Geodetic
from app.domain.plausibility import Doubt
from app.domain.vessel_state import HeadingSource, StateFlag, TrackMethod
from app.tables.sites import Site
from tests.factories.ais import MMSI, NOON, make_position, make_static, make_vessel
from tests.factories.sites import make_site
from worker.tasks.vessel_states import states_around

CAMERA_AT = Geodetic(53.53, 9.98, 30.0)


def test_positions_are_judged_by_all_that_their_vessel_sent(database: Database) -> None:
    """A jump, an MMSI in two places and another side of the world are found; other sites' are not.

    What stands in another site's recording neither raises doubts nor shows that there is one.
    Whole stretches of traffic are judged at once as each position is by itself.
    """
    with database.writing() as session:
        site, other = make_site(session), make_site(session, name="Elsewhere")

        def positions(mmsi: int, *lats: float, at: Site = site) -> list[int]:
            moments = (NOON + timedelta(seconds=10 * index) for index in range(len(lats)))
            return [
                make_position(session, at, moment, mmsi=mmsi, lat_deg=lat).id
                for lat, moment in zip(lats, moments, strict=False)
            ]

        steady = positions(MMSI, 53.5, 53.5, 53.5, 53.5)
        positions(MMSI, 54.5, 54.5, 54.5, 54.5, at=other)
        jumping = positions(MMSI + 1, 53.5, 53.5, 53.9, 53.5, 53.5)
        two = positions(MMSI + 2, 53.5, 53.9, 53.5, 53.9, 53.5)
        far = positions(MMSI + 3, 0.0)
        ids = [*steady, *jumping, *two, *far]
        found = doubts_of(session, frozenset((site.id,)), ids)
        assert set(found) == set(ids)
        assert [found[one] for one in steady] == [[]] * 4
        assert [found[one] for one in jumping] == [[], [], [Doubt.JUMP], [], []]
        assert [found[one] for one in two[1:-1]] == [[Doubt.TWO_PLACES]] * 3
        assert found[far[0]] == [Doubt.FAR_AWAY]
        vessels = range(MMSI, MMSI + 4)
        for seconds in (0, 15, 100):  # some have neighbours outside of it
            end = NOON + timedelta(seconds=seconds)
            at_once = doubts_between(session, frozenset((site.id,)), ids, vessels, NOON, end)
            assert at_once == found
        everywhere = doubts_of(session, None, steady)
        assert any(Doubt.JUMP in of or Doubt.TWO_PLACES in of for of in everywhere.values())


def test_rest_tells_the_doubts_of_positions(client: TestClient, database: Database) -> None:
    """A list of positions has each one's doubts, and nothing is left out of it."""
    with database.writing() as session:
        site = make_site(session)
        for index, lat_deg in enumerate((53.5, 53.5, 53.9, 53.5)):
            make_position(session, site, NOON + timedelta(seconds=10 * index), lat_deg=lat_deg)
        make_vessel(session)
    items = client.get("/api/v1/ais/positions").json()["items"]
    assert [item["doubts"] for item in items] == [[], [], ["jump"], []]
    latest = client.get(f"/api/v1/ais/vessels/{MMSI}").json()["latest_position"]
    assert latest["doubts"] == []


def test_states_carry_the_doubts_of_their_reports(database: Database) -> None:
    """A state made from a report that jumped says so, and so do those of a wrong receiver."""
    with database.writing() as session:
        site = make_site(session)
        for index, lat_deg in enumerate((53.51, 53.51, 53.53, 53.51, 53.51)):
            moment = NOON + timedelta(seconds=10 * index)
            make_position(session, site, moment, lat_deg=lat_deg).heading_deg = None
        said = make_static(session, site, NOON + timedelta(hours=1))
        session.flush()
        settings = FusionSettings(preset=Preset.WATERLINE)
        at = NOON + timedelta(seconds=24)
        hours_later = at + timedelta(hours=2)
        found = states_around(session, site.id, CAMERA_AT, {8: hours_later, 7: at}, settings)
        assert found[8] == []
        (state,) = found[7]
        assert state.heading_source is HeadingSource.COURSE
        assert state.track_method is TrackMethod.HERMITE
        assert len(state.report_ids) == 2
        assert state.static_ids == (said.id,)
        assert state.flags == (StateFlag.HEADING_NOT_REPORTED, StateFlag.LATER_SIZE, Doubt.JUMP)
        asked = FusionSettings(preset=Preset.WATERLINE, track_method=TrackMethod.CTRV_DAMPED)
        (turning,) = states_around(session, site.id, CAMERA_AT, {7: at}, asked)[7]
        assert turning.track_method is TrackMethod.CTRV_DAMPED

        for mmsi in range(MMSI + 1, MMSI + 6):
            make_position(session, site, at, mmsi=mmsi).fix_time_source = "doubtful"
        session.flush()
        states = states_around(session, site.id, CAMERA_AT, {7: at}, settings)[7]
        assert len(states) == 6
        assert all(Doubt.RECEIVER_CLOCK in state.flags for state in states)
