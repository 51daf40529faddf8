"""Positions, vessels and tracks come out: filtered, in pages, within the sites one may read."""

from collections.abc import Callable
from datetime import datetime, timedelta

import pytest
from starlette.testclient import TestClient

from app.ais.service import Area, reports_between
from app.db import Database, now
from app.domain.ais import PositionReport, StaticReport
from app.tables.identity import Role
from tests.factories.ais import MMSI, NOON, make_position, make_static, make_vessel
from tests.factories.sites import make_site
from tests.factories.world import make_feed
from tests.integration.conftest import MakeUser

MINUTE = timedelta(minutes=1)


def positions(client: TestClient, **query: object) -> list[int]:
    """Return the ids of the positions that fulfil a query."""
    answer = client.get("/api/v1/ais/positions", params={k: str(v) for k, v in query.items()})
    assert answer.status_code == 200, answer.text
    return [item["id"] for item in answer.json()["items"]]


def test_positions_by_vessel_time_and_place(client: TestClient, database: Database) -> None:
    """Each filter alone and all together give just the positions that fulfil them."""
    with database.writing() as session:
        site = make_site(session)
        first = make_position(session, site, NOON).id
        later = make_position(session, site, NOON + MINUTE, lon_deg=9.99).id
        other = make_position(session, site, NOON, mmsi=MMSI + 1, lat_deg=-33.0).id
        east = make_position(session, site, NOON, mmsi=MMSI + 2, lon_deg=179.9).id
    assert positions(client) == [first, later, other, east]
    assert positions(client, mmsi=MMSI) == [first, later]
    assert positions(client, **{"from": "2024-05-01T12:00:30Z"}) == [later]
    assert positions(client, mmsi=MMSI, to="2024-05-01T14:00:30+02:00") == [first]
    assert positions(client, bbox="9.985,53,10,54") == [later]
    assert positions(client, bbox="170,50,-170,60") == [east]
    assert positions(client, mmsi=MMSI, to="2024-05-01T12:00:00", bbox="9,53,10,54") == [first]


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"bbox": "1,2,3"}, "bbox"),
        ({"bbox": "9,54,10,53"}, "bbox"),
        ({"bbox": "nan,1,2,3"}, "bbox"),
        ({"bbox": "-200,1,2,3"}, "bbox"),
        ({"mmsi": "-1"}, "mmsi"),
        ({"from": "yesterday"}, "from"),
        ({"from": "0001-01-01T00:00:00+14:00"}, "from"),
        ({"cursor": "x"}, "cursor"),
    ],
)
def test_a_wrong_filter_is_named(client: TestClient, query: dict[str, str], field: str) -> None:
    """The answer to a filter that makes no sense is 422 and names the field."""
    answer = client.get("/api/v1/ais/positions", params=query)
    assert answer.status_code == 422
    assert field in answer.json()["errors"][0]["field"]


def test_positions_come_in_pages(client: TestClient, database: Database) -> None:
    """Following the cursors gives every position once."""
    with database.writing() as session:
        ids = [make_position(session, None, NOON + n * MINUTE).id for n in range(5)]
    seen, cursor = [], None
    while True:
        query = {"limit": "2"} | ({"cursor": cursor} if cursor else {})
        page = client.get("/api/v1/ais/positions", params=query).json()
        seen += [item["id"] for item in page["items"]]
        cursor = page["next_cursor"]
        if cursor is None:
            break
    assert seen == ids


def test_only_own_and_shared_reports_are_seen(
    make_user: MakeUser, client_of: Callable[..., TestClient], database: Database
) -> None:
    """A viewer of one site sees its reports and the shared ones; other vessels do not exist."""
    with database.writing() as session:
        own, foreign = make_site(session), make_site(session)
        mine = make_position(session, own).id
        shared = make_position(session, None, mmsi=MMSI + 1).id
        make_position(session, foreign, mmsi=MMSI + 2)
        make_static(session, foreign, mmsi=MMSI + 2, name="SECRET")
        for number in range(3):
            make_vessel(session, mmsi=MMSI + number, name=f"V{number}")
    viewer = client_of(make_user(Role.VIEWER, own.id))
    assert positions(viewer) == [mine, shared]
    assert positions(viewer, mmsi=MMSI + 2) == []
    vessels = viewer.get("/api/v1/ais/vessels").json()["items"]
    assert [vessel["mmsi"] for vessel in vessels] == [MMSI, MMSI + 1]
    assert viewer.get(f"/api/v1/ais/vessels/{MMSI + 2}").status_code == 404
    assert viewer.get(f"/api/v1/ais/vessels/{MMSI + 2}/track").status_code == 404
    assert viewer.get("/api/v1/ais/vessels/99999999999999999999").status_code == 404
    assert viewer.get("/api/v1/ais/files/99999999999999999999").status_code == 404


@pytest.mark.parametrize(
    ("search", "found"),
    [("elbe", [0]), ("21100000", [0, 1]), ("100%", [1]), ("%", [1]), ("_", []), ("nobody", [])],
)
def test_vessels_are_searched(
    client: TestClient, database: Database, search: str, found: list[int]
) -> None:
    """Parts of names and beginnings of MMSI find vessels; wildcards are plain characters."""
    with database.writing() as session:
        site = make_site(session)
        for number, name in enumerate(("ELBE 3", "100% COTTON")):
            make_vessel(session, mmsi=MMSI + number, name=name)
            make_position(session, site, NOON, mmsi=MMSI + number)
    vessels = client.get("/api/v1/ais/vessels", params={"q": search}).json()["items"]
    assert [vessel["mmsi"] - MMSI for vessel in vessels] == found


def test_a_track_is_broken_at_silences(client: TestClient, database: Database) -> None:
    """Over ten minutes of silence end a piece; a single fix is a point; repeats appear once."""
    with database.writing() as session:
        make_vessel(session)
        site = make_site(session)
        for minutes, lon_deg in ((0, 9.98), (10, 9.99), (21, 10.0)):
            make_position(session, None, NOON + minutes * MINUTE, lon_deg=lon_deg)
        make_position(session, site, NOON, lon_deg=9.98)
    track = client.get(f"/api/v1/ais/vessels/{MMSI}/track").json()
    assert track["type"] == "FeatureCollection"
    line, point = track["features"]
    assert line["geometry"] == {"type": "LineString", "coordinates": [[9.98, 53.54], [9.99, 53.54]]}
    assert line["properties"]["times"] == ["2024-05-01T12:00:00Z", "2024-05-01T12:10:00Z"]
    assert line["properties"]["sog_kn"] == [9.5, 9.5]
    assert point["geometry"] == {"type": "Point", "coordinates": [10.0, 53.54]}
    assert track["truncated"] is False
    part = client.get(f"/api/v1/ais/vessels/{MMSI}/track", params={"from": "2024-05-01T12:15:00Z"})
    assert [feature["geometry"]["type"] for feature in part.json()["features"]] == ["Point"]


def test_the_maps_tracks_are_steps_from_the_stretchs_beginning(
    client: TestClient, database: Database
) -> None:
    """Own and shared fixes of a stretch in an area, each once, unknown motion as -1."""
    with database.writing() as session:
        site = make_site(session)
        for owner in (site, None):
            make_position(session, owner, NOON, lat_deg=53.5).sog_kn = None
        make_position(session, site, NOON + MINUTE, lat_deg=53.501)
        make_position(session, site, NOON, mmsi=MMSI + 1, lat_deg=-33.0)
        path = f"/api/v1/sites/{site.id}/ais/tracks"
    query = {"from": (NOON - MINUTE).isoformat(), "bbox": "9,53,10,54"}
    found = client.get(path, params=query).json()
    (vessel,) = found["vessels"]
    assert (vessel["mmsi"], vessel["flags"]) == (MMSI, [])
    assert (vessel["t"], vessel["lat"], vessel["sog"]) == ([60, 60], [5_350_000, 100], [-1, 95])
    assert found["read_until"] == found["end"]


def test_a_map_that_follows_is_told_only_what_is_new(
    client: TestClient, database: Database
) -> None:
    """From the first answer on each live position comes once; imports and wrong clocks do not."""
    moment = now().replace(microsecond=0)

    def hear(*seconds_ago: float, mmsi: int = MMSI) -> None:
        with database.writing() as session:
            for ago_s in seconds_ago:
                at = moment - timedelta(seconds=ago_s)
                make_position(session, site, at, mmsi=mmsi).feed_id = feed_id

    with database.writing() as session:
        site = make_site(session)
        feed_id = make_feed(session, site.id, "elbe")["feed_id"]
    hear(9)
    path = f"/api/v1/sites/{site.id}/ais/tracks/new"
    first = client.get(path).json()
    assert first["vessels"] == []
    hear(3, 6, -900, 4_000)
    hear(5, mmsi=MMSI + 1)
    with database.writing() as session:
        make_position(session, site, moment, mmsi=MMSI + 2)  # of a recording
    second = client.get(path, params={"after": first["after"], "bbox": "9,53,10,54"}).json()
    told = {vessel["mmsi"]: vessel["t"] for vessel in second["vessels"]}
    assert {mmsi: len(times) for mmsi, times in told.items()} == {MMSI: 2, MMSI + 1: 1}
    begun = datetime.fromisoformat(second["start"])
    assert begun + timedelta(seconds=told[MMSI][0]) == moment - timedelta(seconds=6)
    third = client.get(path, params={"after": second["after"]}).json()
    assert (third["vessels"], third["after"], third["is_cut"]) == ([], second["after"], False)
    assert client.get(path, params={"after": 2**70}).status_code == 422


def test_reports_for_fusion(database: Database) -> None:
    """The window holds near reports of the site and shared ones, each fix once, with row ids."""
    with database.writing() as session:
        site, other = make_site(session), make_site(session)
        wanted = make_position(session, site, NOON).id
        make_position(session, None, NOON)  # the same fix again, shared
        shared = make_position(session, None, NOON + MINUTE, mmsi=MMSI + 1).id
        make_position(session, site, NOON - 10 * MINUTE)
        make_position(session, site, NOON, mmsi=MMSI + 2, lat_deg=53.7)
        make_position(session, other, NOON, mmsi=MMSI + 3)
        make_static(session, None, NOON + 60 * MINUTE, name="LATER")
        make_static(session, site, NOON - 60 * MINUTE, name="EARLIER")
        make_static(session, site, mmsi=MMSI + 2)
    with database.reading() as session:
        area = Area.around(53.54, 9.98, 5_000)
        window = reports_between(session, site.id, NOON - MINUTE, NOON + MINUTE, area)
    assert [report.report_id for report in window.positions] == [wanted, shared]
    assert isinstance(window.positions[0], PositionReport)
    assert window.positions[0].fix_time == NOON
    assert list(window.statics) == [MMSI]
    assert [static.name for static in window.statics[MMSI]] == ["EARLIER", "LATER"]
    assert isinstance(window.statics[MMSI][0], StaticReport)


def test_sizes_said_long_ago_are_found(database: Database) -> None:
    """Of a busy talker only the last hours are read, of a vessel silent since long its size."""
    day = timedelta(days=1)
    with database.writing() as session:
        site = make_site(session)
        for mmsi in (MMSI, MMSI + 1):
            make_position(session, site, NOON, mmsi=mmsi)
            make_static(session, None, NOON - 300 * day, mmsi=mmsi, name="LONG AGO")
            make_static(session, None, NOON + 300 * day, mmsi=mmsi, name="MUCH LATER")
        make_static(session, site, NOON - 2 * MINUTE, name="LATELY")
        make_static(session, site, NOON + MINUTE, mmsi=MMSI + 1, name="JUST AFTER")
    with database.reading() as session:
        found = reports_between(session, site.id, NOON - MINUTE, NOON + MINUTE).statics
    names = {mmsi: [static.name for static in statics] for mmsi, statics in found.items()}
    assert names == {MMSI: ["LATELY"], MMSI + 1: ["LONG AGO", "JUST AFTER", "MUCH LATER"]}
