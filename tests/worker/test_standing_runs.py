"""A live camera: photographs come by folder and HTTP and are fused by themselves, once each."""

from datetime import datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest
import sqlalchemy as sa

from app.config import Settings
from app.db import Database, now
from app.imagery.service import Upload, store_image
from app.live import folders, standing
from app.storage import Storage
from app.tables.detection import DetectionSet
from app.tables.imagery import Image
from app.tables.live import WatchedFile
from app.tables.runs import Match, RunImage
from app.tables.sites import Viewport
from tests.factories.norderelbe import Published, hear, make_norderelbe
from tests.worker.conftest import StartWorker
from tests.worker_process import wait_until

CAME = 6
QUICK = {"QUAYMARK_HEARTBEAT_S": "0.2", "QUAYMARK_TAKEOVER_AFTER_S": "1"}


class Camera:
    """A camera of the published viewport that writes photographs as they are taken."""

    def __init__(self, database: Database, settings: Settings, shared: Path, place: Path) -> None:
        self.place, self._database, self._settings = place, database, settings
        self._storage = Storage(settings.storage_url)
        self.published = Published.read(shared)
        viewport_id, detector = make_norderelbe(database, self._storage, self.published, 0)
        place.mkdir()
        self._hour = (now() - timedelta(hours=1)).replace(minute=0, second=0, microsecond=0)
        with database.writing() as session:
            viewport = session.get_one(Viewport, viewport_id)
            self.id = viewport.camera_id
            folders.add(session, viewport.camera, str(place), moves_files=False)
            standing.add(
                session,
                viewport,
                name="as they come",
                detector=detector,
                preset="paper",
                parameters={},
                ais_wait_s=86_400,
                user_id=None,
            )

    def photograph(self, number: int) -> tuple[str, bytes, datetime]:
        """Return a photograph's name, its bytes, unlike all others', and its moment."""
        moment = self._hour + timedelta(minutes=number)
        local = moment.astimezone(ZoneInfo("Europe/Berlin"))
        data = self.published.photograph + number.to_bytes(4, "big")
        return f"cam_{local:%Y%m%d_%H%M%S}.jpg", data, moment

    def write(self, number: int) -> None:
        """Put a photograph into the folder."""
        name, data, _ = self.photograph(number)
        (self.place / name).write_bytes(data)

    def drop(self, number: int) -> None:
        """Give a photograph as an HTTP drop does."""
        name, data, _ = self.photograph(number)
        store_image(self._database, self._storage, self._settings, self.id, Upload(data, name))

    def count(self, table: type[object], *conditions: sa.ColumnElement[bool]) -> int:
        """Count rows."""
        with self._database.reading() as session:
            statement = sa.select(sa.func.count()).select_from(table).where(*conditions)
            return session.scalar(statement) or 0


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
def test_photographs_are_fused_as_they_come_and_detected_once(
    database: Database,
    settings: Settings,
    start_worker: StartWorker,
    shared_dir: Path,
    tmp_path: Path,
) -> None:
    """A broken, a doubled and a growing file do no harm; a killed worker's work is gone on with."""
    camera = Camera(database, settings, shared_dir, tmp_path / "camera")
    worker = start_worker(**QUICK)
    camera.drop(0)
    for number in range(1, CAME - 1):
        camera.write(number)
    (camera.place / "again.jpg").write_bytes(camera.photograph(1)[1])
    (camera.place / "broken.jpg").write_bytes(camera.published.photograph[:1000])
    name, data, _ = camera.photograph(CAME - 1)
    growing = (camera.place / name).open("wb")
    growing.write(data[: len(data) // 2])
    growing.flush()
    wait_until(lambda: camera.count(RunImage, RunImage.done_at.is_not(None)) > 0, what="a start")
    worker.kill()
    growing.write(data[len(data) // 2 :])
    growing.close()

    start_worker(**QUICK)
    wait_until(
        lambda: camera.count(RunImage, RunImage.done_at.is_not(None)) == CAME, what="all images"
    )
    wait_until(lambda: camera.count(WatchedFile) == CAME + 1, what="all files")
    assert camera.count(Image) == camera.count(DetectionSet) == CAME
    assert camera.count(Match) == 0  # nothing was heard so far
    with database.reading() as session:
        statement = sa.select(DetectionSet.id, DetectionSet.created_at)
        found = session.execute(statement).all()
    with database.writing() as session:
        for number in range(CAME):
            hear(session, camera.published, camera.photograph(number)[2])
    wait_until(lambda: camera.count(Match) == CAME, what="matches with what was heard late")
    with database.reading() as session:
        assert session.execute(statement).all() == found
