"""Backups made while others write, and what comes back of them, on each database and across."""

import hashlib
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from shutil import copy
from typing import Self

import pytest
import sqlalchemy as sa
from starlette.testclient import TestClient

from app.auth.tokens import new_token
from app.config import Settings
from app.db import Base, Database
from app.errors import Conflict, Invalid
from app.job_tables import unended_jobs
from app.jobs import JobClient, JobQueue
from app.keeping.backup import make_backup
from app.keeping.loading import check_references
from app.keeping.repository import FILE_COLUMNS, referenced_files
from app.keeping.restore import restore_backup
from app.keeping.snapshot import kept_tables
from app.storage import Storage
from app.tables.identity import User
from app.tables.imagery import Image
from app.tables.operation import WorkerHeartbeat
from app.tables.sites import Camera, Site
from tests.factories.imagery import photograph
from tests.factories.sites import make_camera, make_site
from tests.factories.world import make_world
from tests.integration.conftest import TEMPLATE
from tests.integration.imagery.conftest import uploader
from tests.postgres import PostgresCluster

TIMES = 20
NAMED_AFTER_OTHER_BYTES = {
    "account_links.mailed_sha256",
    "account_links.token_sha256",
    "recovery_codes.code_sha256",
    "file_findings.sha256",  # of a file that another row names
    "api_tokens.token_sha256",
    "login_sessions.token_sha256",
    "idempotency_keys.request_sha256",
    "detection_sets.image_sha256",  # of an image, which names it itself
    "detection_sets.model_sha256",
    "detection_sets.settings_sha256",
    "ground_truth_images.content_sha256",  # of an image, or a stand-in while that is absent
    "ground_truth_files.sha256",  # all of what was in it stands in tables
}


class Installation:
    """An installation's database and files."""

    def __init__(self, url: str, folder: Path) -> None:
        self.settings = Settings(
            data_dir=folder, database_url=url, storage_url=str(folder / "files")
        )
        self.database = Database(url)
        self.storage = Storage(self.settings.storage_url)

    def back_up(self, path: Path) -> Path:
        """Write an archive."""
        make_backup(self.settings, self.database, self.storage, path, lambda _done, _all: None)
        return path

    def restore(self, path: Path, *, force: bool = False) -> None:
        """Restore an archive."""
        restore_backup(
            self.settings, self.database, self.storage, path, force=force, told=lambda _done: None
        )

    def rows(self) -> dict[str, list[tuple[object, ...]]]:
        """Return all rows of all kept tables."""
        with self.database.reading() as session:
            return {
                table.name: sorted(
                    (tuple(row) for row in session.execute(sa.select(table))), key=repr
                )
                for table in kept_tables()
            }

    def assert_sound(self) -> None:
        """Demand that all references lead somewhere and all files are there with their bytes."""
        with self.database.engine.connect() as connection:
            check_references(connection)
            for sha256 in referenced_files(connection):
                assert hashlib.sha256(self.storage.read(sha256)).hexdigest() == sha256

    def queued(self) -> list[tuple[str, list[object]]]:
        """Return the ids and arguments of the jobs that have not ended."""
        with self.database.engine.connect() as connection:
            return [(job.job_id, list(job.arguments)) for job in unended_jobs(connection)]


NewInstallation = Callable[[str], Installation]


@pytest.fixture
def new_installation(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[NewInstallation]:
    """Give the maker of empty, migrated installations on a kind of database."""
    made: list[Installation] = []
    names: list[str] = []

    def make(kind: str) -> Installation:
        folder = tmp_path / f"installation-{len(made)}"
        folder.mkdir()
        if kind == "sqlite":
            copy(request.getfixturevalue("sqlite_template"), folder / "quaymark.db")
            url = f"sqlite:///{folder / 'quaymark.db'}"
        else:
            cluster: PostgresCluster = request.getfixturevalue("postgres_cluster")
            names.append(f"restored_{new_token()[-16:].lower()}")
            url = cluster.create(names[-1], TEMPLATE)
        made.append(Installation(url, folder))
        return made[-1]

    yield make
    for installation in made:
        installation.database.dispose()
    for name in names:
        request.getfixturevalue("postgres_cluster").drop(name)


@pytest.fixture
def here(database: Database, settings: Settings) -> Installation:
    """Give the test's own installation, with a camera and some of everything in it."""
    installation = Installation(settings.database_url, settings.data_dir)
    with database.writing() as session:
        make_world(session, "Kept", 211000001)
    for number, column in enumerate(FILE_COLUMNS):
        stored = installation.storage.put(f"bytes {number}".encode())
        with database.writing() as session:
            session.execute(sa.update(column.class_).values({column.key: stored.sha256}))
    return installation


def kind_of(installation: Installation) -> str:
    """Return the kind of an installation's database."""
    return "sqlite" if installation.database.is_sqlite else "postgres"


class Writer:
    """A person who uploads photographs and renames the site, for as long as the block lasts."""

    def __init__(self, client: TestClient, camera: Camera) -> None:
        self._client = client
        self._upload = uploader(client, camera)
        self._site = f"/api/v1/sites/{camera.site_id}"
        self._enough = threading.Event()
        self._thread = threading.Thread(target=self._write)
        self.count = 0
        self.wrote = threading.Condition()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._enough.set()
        self._thread.join()

    def wait_for_more(self) -> None:
        """Wait until something more was written."""
        with self.wrote:
            before = self.count
            assert self.wrote.wait_for(lambda: self.count > before, timeout=60)

    def _write(self) -> None:
        while not self._enough.is_set():
            assert self._upload(photograph(self.count)).status_code == 201
            version = self._client.get(self._site).headers["etag"]
            renamed = self._client.patch(
                self._site, json={"name": f"Site {self.count}"}, headers={"If-Match": version}
            )
            assert renamed.status_code == 200
            with self.wrote:
                self.count += 1
                self.wrote.notify_all()


def test_twenty_backups_under_writes_are_each_consistent(
    here: Installation, client: TestClient, new_installation: NewInstallation, tmp_path: Path
) -> None:
    """Whatever is written meanwhile, each copy has whole references and every file it names."""
    with here.database.writing() as session:
        camera = make_camera(session, make_site(session, name="Busy"))
    images = []
    with Writer(client, camera) as writer:
        for number in range(TIMES // 2):
            writer.wait_for_more()
            archive = here.back_up(tmp_path / f"{number}.tar")
            copied = new_installation(kind_of(here))
            copied.restore(archive)
            copied.assert_sound()
            with copied.database.reading() as session:
                images.append(session.scalar(sa.select(sa.func.count(Image.id))))
    assert images == sorted(set(images)), "each copy is of a later moment"


@pytest.mark.parametrize("target", ["sqlite", "postgres"])
def test_a_restored_copy_has_the_same_rows_on_either_database(
    here: Installation, new_installation: NewInstallation, tmp_path: Path, target: str
) -> None:
    """Every value of every table survives, also from SQLite to Postgres and back."""
    archive = here.back_up(tmp_path / "backup.tar")
    copied = new_installation(target)
    copied.restore(archive)

    assert copied.rows() == here.rows()
    assert copied.settings.secret() == here.settings.secret()
    assert archive.stat().st_mode & 0o077 == 0
    with copied.database.writing() as session:  # and life goes on: new rows get new numbers
        make_world(session, "Later", 211000002)


def test_jobs_that_had_not_ended_are_queued_again(
    here: Installation, new_installation: NewInstallation, tmp_path: Path
) -> None:
    """A queued job is in the copy under its own id, and only those that wait."""
    jobs = JobClient(here.database.url)
    with here.database.writing() as session:
        jobs.enqueue(session, "run", 1, {"a": [2]}, queue=JobQueue.RUNS, job_id="waits")
        jobs.enqueue(session, "run", 2, queue=JobQueue.RUNS, job_id="cancelled")
    jobs.cancel("cancelled")
    jobs.destroy()
    archive = here.back_up(tmp_path / "backup.tar")
    copied = new_installation("sqlite")
    copied.restore(archive)

    assert copied.queued() == [("waits", [1, {"a": [2]}])]


def test_data_is_replaced_only_when_told_to(here: Installation, tmp_path: Path) -> None:
    """An installation with data is refused, then replaced as a whole; not while a worker works."""
    archive = here.back_up(tmp_path / "backup.tar")
    before = here.rows()
    with here.database.writing() as session:
        make_site(session, name="Made since")
    with pytest.raises(Conflict, match="--force"):
        here.restore(archive)
    with here.database.writing() as session:
        session.add(WorkerHeartbeat(executor_id="w1", host="h", pid=1, code_version="1"))
    with pytest.raises(Conflict, match="stop web and workers"):
        here.restore(archive, force=True)
    with here.database.writing() as session:
        session.execute(sa.delete(WorkerHeartbeat))
    here.restore(archive, force=True)

    assert here.rows() == before


@pytest.mark.parametrize("harm", ["cut", "changed file", "changed rows"])
def test_a_harmed_archive_is_refused_before_anything_is_stored(
    here: Installation, new_installation: NewInstallation, tmp_path: Path, harm: str
) -> None:
    """An archive cut short or with a flipped byte restores nothing, and says so."""
    archive = here.back_up(tmp_path / "backup.tar")
    data = bytearray(archive.read_bytes())
    if harm == "cut":
        del data[len(data) // 2 :]
    else:
        begin = data.index(b"bytes 0" if harm == "changed file" else b"tables/sites.ndjson.gz")
        data[begin + (3 if harm == "changed file" else 512 + 12)] ^= 1
    archive.write_bytes(data)
    copied = new_installation("sqlite")
    with pytest.raises(Invalid, match="cannot be restored"):
        copied.restore(archive)

    with copied.database.reading() as session:
        assert session.scalar(sa.select(sa.func.count(User.id))) == 0
        assert session.scalar(sa.select(sa.func.count(Site.id))) == 0
    assert list(copied.storage.addresses()) == []


def test_lost_and_damaged_files_are_named_and_do_not_stop_a_backup(
    here: Installation, tmp_path: Path
) -> None:
    """What the store has lost is in the manifest; a restore mends what was damaged since."""
    whole = here.back_up(tmp_path / "whole.tar")
    with here.database.engine.connect() as connection:
        damaged, missing, *_ = referenced_files(connection)
    path = here.storage.local_path(damaged)
    assert path is not None
    path.write_bytes(b"rotten")
    assert here.storage.remove(missing, untouched_for_s=0.0)

    manifest = make_backup(
        here.settings, here.database, here.storage, tmp_path / "b.tar", lambda _done, _all: None
    )
    assert (list(manifest.missing), list(manifest.damaged)) == ([missing], [damaged])
    here.restore(whole, force=True)
    here.assert_sound()


def test_every_column_that_names_a_file_is_backed_up() -> None:
    """A new table with files cannot be forgotten: its column is listed, or named here."""
    listed = {f"{column.class_.__tablename__}.{column.key}" for column in FILE_COLUMNS}
    named = {
        f"{table.name}.{column.name}"
        for table in Base.metadata.tables.values()
        for column in table.columns
        if column.name.endswith("sha256")
    }
    assert named - listed <= NAMED_AFTER_OTHER_BYTES
