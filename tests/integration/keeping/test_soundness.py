"""What `quaymark db check` and the daily look at the files find, on each database."""

from app.config import Settings
from app.db import Database
from app.detectors.service import IMPORTED_FAMILY
from app.keeping.files import check_files
from app.keeping.repository import findings
from app.keeping.soundness import orphans, problems
from app.storage import Storage
from app.tables.ais import AisFile
from app.tables.imagery import Image
from app.tables.operation import FileProblem
from app.tables.runs import Run
from tests.factories.detectors import make_model
from tests.factories.imagery import make_image
from tests.factories.sites import make_camera, make_site
from tests.factories.world import make_world


def test_lost_and_rotten_files_are_found_and_forgotten_once_whole(
    database: Database, settings: Settings
) -> None:
    """A missing and a changed file are kept as findings until they are whole again."""
    storage = Storage(settings.storage_url)
    kept, rotten = storage.put(b"kept"), storage.put(b"rotten")
    with database.writing() as session:
        camera = make_camera(session, make_site(session))
        for sha256 in (kept.sha256, rotten.sha256):
            make_image(session, camera, sha256=sha256)
        # Its boxes are rows, and of the file they came in only the hash is known.
        make_model(session, family=IMPORTED_FAMILY)
    assert check_files(database, storage).damaged == 0
    path = storage.local_path(rotten.sha256)
    assert path is not None
    path.write_bytes(b"changed")
    assert storage.remove(kept.sha256, untouched_for_s=0.0)
    looked = check_files(database, storage)

    assert (looked.files, looked.missing, looked.damaged) == (2, 1, 1)
    with database.reading() as session:
        assert findings(session) == {
            kept.sha256: FileProblem.MISSING,
            rotten.sha256: FileProblem.DAMAGED,
        }
    path.write_bytes(b"rotten")
    storage.put(b"kept")
    check_files(database, storage)
    with database.reading() as session:
        assert findings(session) == {}


def test_a_database_that_contradicts_itself_is_told(database: Database, settings: Settings) -> None:
    """Missing files, sums that do not add up and miscounted runs are each a line."""
    storage = Storage(settings.storage_url)
    with database.writing() as session:
        ids = make_world(session, "Elbe", 211000001)
        session.get_one(Run, ids["run_id"]).image_count = 7
        file = session.get_one(AisFile, ids["file_id"])
        lines = {**file.accounting["lines"], "total": 5}
        file.accounting = {**file.accounting, "lines": lines}
        assert session.get_one(Image, ids["image_id"])
    storage.put(b"of nobody")
    told = "\n".join(problems(database, storage))

    assert "files are missing in the store" in told
    assert f"recording {ids['file_id']} (Elbe.csv)" in told
    assert f"run {ids['run_id']}: 7 images announced, 1 there" in told
    assert orphans(database, storage) == 1
