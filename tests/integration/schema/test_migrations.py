"""The tables: made and removed by migrations alone, on both databases, and as the code has them."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa

from app import schema
from app.auth.tokens import new_token
from app.db import Base, Database
from app.errors import Conflict
from app.jobs import JobClient, JobQueue
from app.tables.ais import AisPosition
from app.tables.registration import Registration, RegistrationMethod
from app.tables.runs import Run
from tests.factories.ais import make_position
from tests.factories.sites import make_site
from tests.factories.world import make_world
from tests.postgres import PostgresCluster

ALEMBIC = "alembic_version"


@pytest.fixture(params=["sqlite", "postgres"])
def empty_database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """Give a database of each kind without any table."""
    if request.param == "sqlite":
        database = Database(f"sqlite:///{tmp_path / 'empty.db'}")
        yield database
        database.dispose()
        return
    cluster: PostgresCluster = request.getfixturevalue("postgres_cluster")
    name = f"empty_{new_token()[-16:].lower()}"
    database = Database(cluster.create(name))
    yield database
    database.dispose()
    cluster.drop(name)


def own_tables(database: Database) -> set[str]:
    """Return the tables that are not the job engine's."""
    names = set(sa.inspect(database.engine).get_table_names())
    return names & (set(Base.metadata.tables) | {ALEMBIC})


def test_migrations_make_what_the_code_expects(empty_database: Database) -> None:
    """After `upgrade` nothing differs between the tables in the code and in the database."""
    schema.upgrade(empty_database)

    assert own_tables(empty_database) == set(Base.metadata.tables) | {ALEMBIC}
    assert schema.differences(empty_database) == []
    assert schema.current_revision(empty_database) == schema.head_revision()


def test_migrations_can_be_taken_back_and_made_again(empty_database: Database) -> None:
    """`downgrade base` leaves none of our tables, and `upgrade` then works as on the first day."""
    schema.upgrade(empty_database)
    schema.downgrade(empty_database, "base")

    assert own_tables(empty_database) <= {ALEMBIC}
    assert schema.current_revision(empty_database) is None
    schema.upgrade(empty_database)
    assert schema.differences(empty_database) == []


def test_upgrading_twice_changes_nothing(empty_database: Database) -> None:
    """An upgrade of a database that is up to date is harmless, with rows in it too."""
    schema.upgrade(empty_database)
    with empty_database.writing() as session:
        make_site(session)
    schema.upgrade(empty_database)

    with empty_database.reading() as session:
        assert session.scalar(sa.text("SELECT count(*) FROM sites")) == 1


def test_a_difference_is_found(empty_database: Database) -> None:
    """`differences` is no rubber stamp: a column that the code does not know is told."""
    schema.upgrade(empty_database)
    with empty_database.writing() as session:
        session.execute(sa.text("ALTER TABLE sites ADD COLUMN surplus INTEGER"))

    assert "surplus" in str(schema.differences(empty_database))


def test_another_revision_is_refused(empty_database: Database) -> None:
    """A database without our tables is refused with the command that mends it."""
    with pytest.raises(Conflict, match="quaymark db upgrade"):
        schema.refuse_other_version(empty_database)
    schema.upgrade(empty_database)
    schema.refuse_other_version(empty_database)


def test_the_job_engine_can_enqueue_at_once(empty_database: Database) -> None:
    """One upgrade makes the job engine's tables too: no process has to make them while serving."""
    schema.upgrade(empty_database)
    jobs = JobClient(empty_database.url)
    with empty_database.writing() as session:
        jobs.enqueue(session, "any", 1, queue=JobQueue.SHORT, job_id="job-1")
    jobs.cancel("job-1")
    jobs.destroy()


def test_making_registrations_anew_keeps_what_refers_to_them(empty_database: Database) -> None:
    """Where SQLite copies a table to change its check, runs that point to it stay, there and back.

    A method the older tables do not know becomes the nearest that they do.
    """
    schema.upgrade(empty_database)
    with empty_database.writing() as session:
        ids = make_world(session, "Old", 211000001)
        session.get_one(Registration, ids["registration_id"]).method = RegistrationMethod.ROTATION

    schema.downgrade(empty_database, "0005")
    with empty_database.reading() as session:
        methods = session.execute(sa.text("SELECT method FROM registrations")).scalars().all()
    schema.upgrade(empty_database)

    assert methods == ["given"]
    with empty_database.reading() as session:
        run = session.get_one(Run, ids["run_id"])
        assert run.registration.id == ids["registration_id"]


def test_moments_of_positions_keep_each_microsecond(empty_database: Database) -> None:
    """Made numbers on SQLite and taken back to text, they are what they were; indexes stay."""
    moment = datetime(2024, 5, 1, 12, 30, 15, 7, UTC)
    schema.upgrade(empty_database)
    with empty_database.writing() as session:
        make_position(session, None, moment).arrived_at = moment

    schema.downgrade(empty_database, "0027")
    with empty_database.reading() as session:
        before = session.scalar(sa.text("SELECT fix_time FROM ais_positions"))
    schema.upgrade(empty_database)

    assert before == ("2024-05-01 12:30:15.000007" if empty_database.is_sqlite else moment)
    with empty_database.reading() as session:
        kept = session.scalars(sa.select(AisPosition)).one()
    assert {kept.fix_time, kept.received_at, kept.arrived_at} == {moment}
    assert schema.differences(empty_database) == []


def test_data_of_the_first_version_survives_every_upgrade(empty_database: Database) -> None:
    """Rows stored under the first migration are there under the newest, value for value."""
    schema.upgrade(empty_database, "0001")
    first = sa.MetaData()
    first.reflect(empty_database.engine, only=["sites", "cameras", "users", "memberships"])
    moment = datetime(2025, 5, 1, 12, 30, 15, tzinfo=UTC).replace(tzinfo=None)
    stored = {
        "sites": {"name": "Elbe", "origin_lat_deg": 53.5, "timezone": "Europe/Berlin"},
        "cameras": {"site_id": 1, "name": "East", "fx_px": 6570.7, "distortion": [0.1] * 5},
        "users": {"email": "ada@harbour.example", "password_hash": "x", "name": "Ada"},
        "memberships": {"user_id": 1, "site_id": 1, "role": "operator"},
    }
    with empty_database.engine.execution_options(writes=True).begin() as connection:
        for name, values in stored.items():
            table = first.tables[name]
            row = {column.name: 1 for column in table.columns if not column.nullable}
            row |= {"created_at": moment} if "created_at" in table.c else {}
            flags = [c.name for c in table.columns if isinstance(c.type, sa.Boolean)]
            row |= dict.fromkeys(flags, True)
            texts = [c.name for c in table.columns if isinstance(c.type, sa.String)]
            row |= {name: "1" for name in texts if name in row}
            connection.execute(table.insert().values(row | values))
    schema.upgrade(empty_database)

    assert schema.differences(empty_database) == []
    with empty_database.reading() as session:
        for name, values in stored.items():
            columns = [sa.column(column) for column in values if column != "distortion"]
            row = session.execute(sa.select(*columns).select_from(sa.table(name))).one()
            assert list(row) == [v for column, v in values.items() if column != "distortion"]
