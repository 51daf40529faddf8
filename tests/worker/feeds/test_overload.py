"""More than the database takes: what has no room is dropped and counted, and nothing else is."""

import time

import sqlalchemy as sa

from app.db import Database
from app.tables.operation import Lease
from tests.feeder import Feeder, position_lines
from tests.worker.feeds.conftest import Feeds
from tests.worker.feeds.test_tcp_feeds import assert_sums_hold
from tests.worker_process import wait_until

FLOOD = 2_000
FULL = """
CREATE FUNCTION full_up() RETURNS trigger LANGUAGE plpgsql AS
    $$ BEGIN RAISE EXCEPTION 'no space left' USING ERRCODE = 'disk_full'; END $$;
CREATE TRIGGER full_up BEFORE INSERT ON ais_positions EXECUTE FUNCTION full_up();
"""


def fill_up(database: Database) -> None:
    """Let no report be stored any more."""
    _execute(database, "ALTER TABLE vessels RENAME TO gone" if database.is_sqlite else FULL)


def make_room(database: Database) -> None:
    """Let reports be stored again."""
    back = "ALTER TABLE gone RENAME TO vessels"
    _execute(database, back if database.is_sqlite else "DROP FUNCTION full_up CASCADE")


def _execute(database: Database, statement: str) -> None:
    with database.writing() as session:
        session.connection().exec_driver_sql(statement)


def test_a_flood_is_dropped_and_counted(database: Database, feeds: Feeds, feeder: Feeder) -> None:
    """While the database is busy a bounded number of lines is kept; each other one is counted."""
    feed_id = feeds.add(feeder.port)
    feeds.receive(feed_queue_lines=100)
    feeder.wait_for_client()
    feeder.send(*position_lines(1))
    wait_until(feeds.has(feed_id, 1, "lines", "total"), what="the first line")
    with database.writing() as session:
        session.execute(sa.select(Lease).with_for_update())  # SQLite: the only writer's place
        for start in range(0, FLOOD, 100):
            feeder.send(*position_lines(100, first=1 + start))
            time.sleep(0.01)
    wait_until(feeds.has(feed_id, FLOOD + 1, "lines", "total"), what="the whole flood")
    status = feeds.status(feed_id)
    assert status is not None
    assert_sums_hold(status.accounting)
    assert status.accounting["lines"]["dropped"] > 0
    assert status.accounting["messages"]["positions"] == len(feeds.positions(feed_id))


def test_nothing_is_lost_while_the_database_is_away(
    database: Database, feeds: Feeds, feeder: Feeder
) -> None:
    """Lines that come while nothing can be stored are stored, once, as soon as it can be again."""
    feed_id = feeds.add(feeder.port)
    feeds.receive()
    feeder.wait_for_client()
    feeder.send(*position_lines(1))
    wait_until(feeds.has(feed_id, 1, "lines", "total"), what="the first line")
    fill_up(database)
    feeder.send(*position_lines(10, first=1))
    time.sleep(0.3)  # some tries that fail
    make_room(database)
    feeder.send(*position_lines(1, first=11))
    wait_until(feeds.has(feed_id, 12, "lines", "total"), what="the lines of the outage")
    status = feeds.status(feed_id)
    assert status is not None
    assert_sums_hold(status.accounting)
    assert status.accounting["lines"]["dropped"] == 0
    assert len(feeds.positions(feed_id)) == 12
