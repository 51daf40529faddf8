"""How connections behave: what SQLite is told on each, and what both databases then promise."""

import time
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest
import sqlalchemy as sa

from app.db import BUSY_TIMEOUT_MS, Database, find
from app.jobs import make_job_engine
from app.tables.sites import Site
from tests.factories.sites import make_camera, make_site

SYNCHRONOUS_FULL = 2


@pytest.mark.parametrize("ours", [True, False], ids=["application", "job engine"])
def test_sqlite_is_set_up_on_every_connection(tmp_path: Path, *, ours: bool) -> None:
    """WAL, foreign keys, a patient wait and full durability hold on each connection."""
    url = f"sqlite:///{tmp_path / 'quaymark.db'}"
    engine = Database(url).engine if ours else make_job_engine(url)
    with engine.connect() as first, engine.connect() as second:
        for connection in (first, second):
            pragmas = {
                name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
                for name in ("journal_mode", "foreign_keys", "busy_timeout", "synchronous")
            }
            assert pragmas == {
                "journal_mode": "wal",
                "foreign_keys": 1,
                "busy_timeout": BUSY_TIMEOUT_MS,
                "synchronous": SYNCHRONOUS_FULL,
            }
    engine.dispose()


def test_foreign_keys_are_enforced(database: Database) -> None:
    """A row cannot point to a row that is not there, on SQLite as on Postgres."""
    with pytest.raises(sa.exc.IntegrityError), database.writing() as session:
        make_camera(session, Site(id=4711))


def test_removing_a_site_removes_what_hangs_on_it(database: Database) -> None:
    """The database itself removes dependent rows, so none is left pointing nowhere."""
    with database.writing() as session:
        site = make_site(session)
        make_camera(session, site)
    with database.writing() as session:
        session.execute(sa.delete(Site).where(Site.id == site.id))
        assert session.scalar(sa.text("SELECT count(*) FROM cameras")) == 0


def test_a_reader_sees_the_state_before_a_writer_commits(database: Database) -> None:
    """A reader neither waits for a writer nor sees half of what it does."""
    with database.writing() as writer:
        make_site(writer)
        with database.reading() as reader:
            assert reader.scalar(sa.select(sa.func.count()).select_from(Site)) == 0
    with database.reading() as reader:
        assert reader.scalar(sa.select(sa.func.count()).select_from(Site)) == 1


def test_a_failed_block_leaves_nothing(database: Database) -> None:
    """What a writing block did before it failed is undone."""

    def fail_half_way() -> None:
        with database.writing() as session:
            make_site(session)
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail_half_way()
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Site)) == 0


def test_moments_keep_their_instant(database: Database) -> None:
    """A moment of any zone comes back as the same instant in UTC; one without a zone is refused."""
    berlin = timezone(timedelta(hours=1))
    moment = datetime(2026, 11, 22, 13, 0, 5, 123456, berlin)
    with database.writing() as session:
        site = make_site(session, created_at=moment)
    with database.reading() as session:
        kept = session.get_one(Site, site.id).created_at
    assert (kept, kept.tzinfo) == (moment, UTC)

    naive = moment.replace(tzinfo=None)
    with pytest.raises(sa.exc.StatementError, match="time zone"), database.writing() as session:
        make_site(session, created_at=naive)


@pytest.mark.parametrize("identifier", [0, -1, 2**31, 2**63, 10**30])
def test_an_id_that_no_column_holds_is_unknown(database: Database, identifier: int) -> None:
    """A number too large for the column is no error of the database, just an unknown id."""
    with database.reading() as session:
        assert find(session, Site, identifier) is None


@pytest.mark.parametrize("database_url", ["postgres"], indirect=True)
def test_a_frozen_writer_keeps_nobody_waiting(database: Database, database_url: str) -> None:
    """A transaction that stands idle for too long is ended, with nothing of it stored."""
    limited = Database(database_url, idle_limit_s=0.1)
    with limited.session(writes=True) as session:
        make_site(session, "of the frozen")
        session.flush()
        time.sleep(0.5)
        with pytest.raises(sa.exc.DBAPIError, match="idle-in-transaction"):
            session.commit()
    limited.dispose()
    with database.reading() as session:
        assert session.scalars(sa.select(Site)).all() == []
