"""Asking for the vessels near a camera at a moment, in tables of one and of ten million positions.

Traffic of a whole coast over weeks, on SQLite and on Postgres. Measured are the two questions that
matter: what a run asks for each of its images, and what a script asks of the REST API's service.
Give the number of millions to measure less or more: `python benchmarks/bench_ais_near.py 1 2`.
"""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import partial

import numpy as np
import sqlalchemy as sa
from sqlalchemy.orm import Session

from app import schema
from app.ais.area import Area
from app.ais.service import PositionFilter, list_positions
from app.db import Database
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import Geodetic
from app.paging import Paging
from app.tables.ais import AisPosition, AisStatic
from benchmarks.workbench import p95, show, show_load, taken_ms
from tests.factories.sites import make_site
from tests.postgres import PostgresCluster
from worker.tasks.vessel_states import states_around

MILLIONS = (1, 10)
AIM_P95_MS = 20.0
AIM_GROWTH = 1.5
QUESTIONS = 200
VESSELS = 400
HARBOURS = 40
START = datetime(2024, 5, 1, tzinfo=UTC)
SECONDS_A_MILLION = 259_200  # three days: four reports a second
_BATCH = 1_000_000
_WARM_UP = 20

# Forty harbours on a coast of 400 by 250 km, ten vessels under way in each at any time that report
# every two minutes or less and send their size too. The numbers are drawn by multiplying with
# primes, so both databases get the same rows, in the order of time as they come in.
POSITIONS = """
INSERT INTO ais_positions (mmsi, fix_time, received_at, lat_deg, lon_deg, sog_kn, cog_deg,
    heading_deg, message_type, ais_class, high_accuracy, fix_time_source, hour, cell)
SELECT 211000000 + vessel, {fix}, {fix}, lat, lon, n % 200 / 10.0, n % 3600 / 10.0,
    n % 360, 1, 'A', {true}, 'prompt', {hour}, {cell}
FROM (
    SELECT n, vessel, n * 0.2592 AS second_s,
        53.0 + vessel % {harbours} * 3571 % 2250 / 1000.0 + n * 31 % 997 * 0.00005 AS lat,
        8.0 + vessel % {harbours} * 6151 % 6000 / 1000.0 + n * 17 % 991 * 0.00005 AS lon
    FROM (SELECT n, n * 7919 % {vessels} AS vessel FROM ({numbers}) AS counted) AS drawn
) AS placed
"""
STATICS = """
INSERT INTO ais_statics (mmsi, received_at, name, to_bow_m, to_stern_m, to_port_m, to_starboard_m)
SELECT 211000000 + n % {vessels}, {moment}, 'VESSEL', 80, 20, 8, 8
FROM (SELECT n, n * 2.592 AS second_s FROM ({numbers}) AS counted) AS drawn
"""
DIALECTS = {
    "sqlite": {
        "numbers": "WITH RECURSIVE c(n) AS (SELECT {first} UNION ALL SELECT n + 1 FROM c "
        "WHERE n < {last}) SELECT n FROM c",
        "moment": "strftime('%Y-%m-%d %H:%M:%f000', 1714521600 + second_s, 'unixepoch')",
        "fix": "CAST((1714521600 + second_s) * 1000000 AS INTEGER)",
        "hour": "(1714521600 + CAST(second_s AS INTEGER)) / 3600",
        "cell": "CAST((lat + 90) * 20 AS INTEGER) * 7201 + CAST((lon + 180) * 20 AS INTEGER)",
        "true": "1",
    },
    "postgresql": {
        "numbers": "SELECT generate_series({first}::bigint, {last}) AS n",
        "moment": "to_timestamp(1714521600 + second_s)",
        "fix": "to_timestamp(1714521600 + second_s)",
        "hour": "floor((1714521600 + second_s) / 3600)::int",
        "cell": "floor((lat + 90) * 20)::int * 7201 + floor((lon + 180) * 20)::int",
        "true": "true",
    },
}


def main() -> None:
    """Measure both databases at each size."""
    sizes = tuple(map(int, sys.argv[1:])) or MILLIONS
    with tempfile.TemporaryDirectory() as folder:
        database = Database(f"sqlite:///{folder}/quaymark.db")
        _measure("SQLite", database, sizes)
    with PostgresCluster() as cluster:
        _measure("Postgres", Database(cluster.create("near")), sizes)
    show_load()


def _measure(label: str, database: Database, sizes: tuple[int, ...]) -> None:
    schema.upgrade(database)
    with database.writing() as session:
        site_id = make_site(session).id
    found: dict[str, list[float]] = {}
    filled = 0
    for size in sizes:
        with _without_indexes(database):
            for million in range(filled, size):
                _fill(database, million)
        filled = size
        _settle(database)
        for question, taken in _asked(database, site_id, size).items():
            show(f"{label}, {size} million, {question}", taken)
            found.setdefault(question, []).append(p95(taken))
    for question, values in found.items():
        growth = values[-1] / values[0]
        met = values[-1] <= AIM_P95_MS and growth <= AIM_GROWTH
        print(
            f"aim for {question}: p95 at most {AIM_P95_MS:.0f} ms, growth at most {AIM_GROWTH}: "
            f"{values[-1]:.1f} ms, {growth:.2f}: {'met' if met else 'MISSED'}"
        )
    database.dispose()


def _fill(database: Database, million: int) -> None:
    """Add a million positions, and the statics that come with them."""
    words = DIALECTS[database.engine.dialect.name]
    for statement, rows in ((POSITIONS, _BATCH), (STATICS, _BATCH // 10)):
        first = million * rows
        numbers = words["numbers"].format(first=first, last=first + rows - 1)
        with database.writing() as session:
            if database.is_sqlite:
                session.connection().exec_driver_sql("PRAGMA cache_size = -262144")
            told = statement.format(
                **(words | {"numbers": numbers, "vessels": VESSELS, "harbours": HARBOURS})
            )
            session.connection().exec_driver_sql(
                told if database.is_sqlite else told.replace("%", "%%")
            )


@contextmanager
def _without_indexes(database: Database) -> Iterator[None]:
    """Take the indexes away and make them anew from all rows: several times as fast."""
    indexes = [
        index
        for table in (AisPosition, AisStatic)
        for index in sa.inspect(table).local_table.indexes
    ]
    with database.writing() as session:
        for index in indexes:
            index.drop(session.connection())
    yield
    with database.writing() as session:
        if database.is_sqlite:
            session.connection().exec_driver_sql("PRAGMA cache_size = -262144")
        for index in indexes:
            index.create(session.connection())


def _settle(database: Database) -> None:
    """Let Postgres look at its tables, as it does by itself in time; SQLite stays as it is."""
    if database.is_sqlite:
        return
    with database.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        connection.execute(sa.text("VACUUM ANALYZE ais_positions"))
        connection.execute(sa.text("VACUUM ANALYZE ais_statics"))


def _asked(database: Database, site_id: int, millions: int) -> dict[str, list[float]]:
    """Ask each question at harbours and moments drawn anew, ms; caches get warm as in use."""
    rng = np.random.default_rng(millions)
    taken: dict[str, list[float]] = {"states around an image": [], "a box over REST": []}
    heard = 0
    with database.reading() as session:
        for _ in range(QUESTIONS + _WARM_UP):
            place = _harbour(int(rng.integers(HARBOURS)))
            at = START + timedelta(seconds=millions * SECONDS_A_MILLION * rng.random())
            ask_states = partial(states_around, session, site_id, place, {1: at}, FusionSettings())
            ask_box = partial(_box, session, site_id, place, at)
            taken["states around an image"].append(taken_ms(ask_states))
            taken["a box over REST"].append(taken_ms(ask_box))
            heard += len(ask_states()[1])
    print(f"   vessels near an image: {heard / (QUESTIONS + _WARM_UP):.1f} on average")
    return {question: values[_WARM_UP:] for question, values in taken.items()}


def _harbour(number: int) -> Geodetic:
    """Return the middle of a harbour, as `POSITIONS` places them."""
    return Geodetic(53.025 + number * 3571 % 2250 / 1000, 8.025 + number * 6151 % 6000 / 1000, 20.0)


def _box(session: Session, site_id: int, place: Geodetic, at: datetime) -> object:
    wanted = PositionFilter(
        start=at - timedelta(minutes=1),
        end=at + timedelta(minutes=1),
        area=Area.around(place.lat_deg, place.lon_deg, 5_000),
    )
    return list_positions(session, frozenset((site_id,)), Paging(limit=100, after=None), wanted)


if __name__ == "__main__":
    main()
