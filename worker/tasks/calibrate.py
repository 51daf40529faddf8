"""The job of a calibration: the corners in each photograph, then the lens."""

import cv2
import structlog
from sqlalchemy.orm import Session

from app.calibration import service
from app.config import Settings
from app.db import Database, now
from app.domain.calibration import CornerSearch, find_corners
from app.errors import AppError
from app.jobs import JobRunner
from app.storage import Storage
from app.tables.calibration import CalibrationPhoto, CalibrationStatus
from worker.inference.image import decode_image

log = structlog.get_logger()
THREADS = 2


class Calibrate:
    """Does the jobs of calibrations."""

    job = service.CALIBRATION_JOB

    def __init__(
        self,
        runner: JobRunner,
        database: Database,
        storage: Storage,
        settings: Settings,  # noqa: ARG002  all tasks are made alike
    ) -> None:
        self._runner = runner
        self._database = database
        self._storage = storage

    def do(self, calibration_id: int) -> None:
        """Look for the board in each photograph, then solve."""
        cv2.setNumThreads(THREADS)
        numbers = self._runner.step("begin", self._begin, calibration_id)
        for number in numbers:
            self._runner.step("search", self._search, calibration_id, number)
        self._runner.step("solve", self._solve, calibration_id)

    def fail(self, reason: str, calibration_id: int) -> None:
        """Say that a calibration failed, and why."""
        service.mark(self._runner.session(), calibration_id, CalibrationStatus.FAILED, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that a calibration's job is not tried again, and why."""
        service.fail_job(session, job_id, reason)

    def _begin(self, calibration_id: int) -> list[int]:
        session = self._runner.session()
        service.mark(session, calibration_id, CalibrationStatus.RUNNING)
        found = service.photos(session, calibration_id)
        return [photo.position for photo in found if photo.problem is None]

    def _search(self, calibration_id: int, number: int) -> None:
        with self._database.reading() as session:
            photo = service.get_photo(session, calibration_id, number)
            board = service.board_of(service.get(session, calibration_id))
        try:
            search = find_corners(decode_image(self._storage.read(photo.sha256)), board)
        except (AppError, ValueError, cv2.error) as error:
            log.warning("photograph not usable", photo_id=photo.id, error=str(error))
            search = CornerSearch(None, "the photograph cannot be read")
        row = self._runner.session().get_one(CalibrationPhoto, photo.id)
        row.problem, row.searched_at = search.problem, now()
        row.corners = None if search.corners_px is None else search.corners_px.tolist()

    def _solve(self, calibration_id: int) -> None:
        with self._database.reading() as session:
            row = service.get(session, calibration_id)
            lens = service.solved(row, service.photos(session, calibration_id), ())
        session = self._runner.session()
        row = service.get(session, calibration_id)
        service.keep_solution(row, service.photos(session, calibration_id), (), lens)
        session.flush()
