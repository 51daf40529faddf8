"""The job of re-registering: images in order of time, each against a bank of known ones.

A step computes some images and stores what came of them in one transaction. The bank lives in the
rows (which image passed, turned how), so a worker that takes over builds it again; the features of
its keyframes are kept in memory meanwhile. After all images had their turn, those that were refused
are tried once more, because by then the bank knows more weather.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import structlog
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.reregistration import Gate, Keyframe, Refusal, Turn, find_turn
from app.domain.reregistration_features import Features, extract_features
from app.domain.reregistration_pointings import group_pointings
from app.domain.reregistration_scenery import Scene, scenery
from app.domain.rotations import matrix_from_rotvec, rotvec_from_matrix
from app.errors import AppError, Conflict
from app.jobs import JobRunner
from app.registration.service import camera_of
from app.reregistration import accepting, repository
from app.reregistration import service as reregistrations
from app.reregistration.schemas import AcceptIn
from app.storage import Storage
from app.tables.imagery import Image
from app.tables.reregistration import (
    Pointing,
    Reregistration,
    ReregistrationImage,
    ReregistrationStatus,
)
from worker.inference.image import decode_image

log = structlog.get_logger()
IMAGES_PER_STEP = 4
KEYFRAMES_ASKED = 3
REFERENCE_FEATURES = 8000
KEYFRAME_FEATURES = 4000
FEATURES_KEPT = 24  # of keyframes, 5 MB each
THREADS = 2
DAY_S = 86_400
KEYFRAME_INLIERS = 30


@dataclass(frozen=True)
class _Context:
    """What all steps of a re-registration share."""

    row: Reregistration
    reference: Image
    camera: Camera
    scene: Scene
    gate: Gate


class Reregister:
    """Does the jobs of re-registrations."""

    job = reregistrations.REREGISTRATION_JOB

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
        self._features: OrderedDict[tuple[int, int], Features] = OrderedDict()

    def do(self, reregistration_id: int) -> None:
        """Look at all images, then group them into pointings."""
        cv2.setNumThreads(THREADS)
        images = self._runner.step("begin", self._begin, reregistration_id)
        for attempt in (1, 2):
            for start in range(0, images, IMAGES_PER_STEP):
                stop = start + IMAGES_PER_STEP
                self._runner.step("images", self._do, reregistration_id, start, stop, attempt)
        self._features.clear()
        self._runner.step("finish", self._finish, reregistration_id)

    def fail(self, reason: str, reregistration_id: int) -> None:
        """Say that a re-registration failed, and why."""
        reregistrations.fail(self._runner.session(), reregistration_id, reason)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Say that a re-registration's job is not tried again, and why."""
        reregistrations.fail_job(session, job_id, reason)

    def _begin(self, reregistration_id: int) -> int:
        return repository.begin(self._runner.session(), reregistration_id)

    def _do(self, reregistration_id: int, start: int, stop: int, attempt: int) -> int:
        with self._database.reading() as session:
            wanted = repository.undone(session, reregistration_id, start, stop, attempt)
            if not wanted:
                return 0
            known = list(repository.images(session, reregistration_id, passed=True))
            context = _context(session, reregistration_id)
        outcomes = []
        for row in wanted:
            turn, message = self._look(context, row, known)
            outcome = _outcome(row, turn, message, attempt)
            outcomes.append(outcome)
            if turn.passed:
                known.append(_as_known(row, outcome))
        repository.store(self._runner.session(), reregistration_id, outcomes)
        return len(outcomes)

    def _look(
        self, context: _Context, row: ReregistrationImage, known: Sequence[ReregistrationImage]
    ) -> tuple[Turn, str | None]:
        image, intrinsics = row.image, context.camera.intrinsics
        if (image.width_px, image.height_px) != (intrinsics.width_px, intrinsics.height_px):
            return Turn(Refusal.WRONG_SIZE), None
        try:
            if image.deleted_at is not None:
                raise Conflict("the image was deleted before its turn came")
            features = extract_features(decode_image(self._storage.read(image.sha256)))
        except (AppError, ValueError, cv2.error) as error:
            log.warning("image not usable", image_id=image.id, error=str(error))
            return Turn(Refusal.UNREADABLE), str(error)
        turn = find_turn(features, intrinsics, self._bank(context, row, known), context.gate)
        return turn, None

    def _bank(
        self, context: _Context, row: ReregistrationImage, known: Sequence[ReregistrationImage]
    ) -> list[Keyframe]:
        """Return the reference and a few keyframes: the last, the strongest, alike in daylight."""
        bank = [self._keyframe(context, context.reference, np.eye(3), REFERENCE_FEATURES)]
        for near in _helpful(row, known)[: KEYFRAMES_ASKED - 1]:
            turned = matrix_from_rotvec(near.rotation_from_reference or (0, 0, 0))
            bank.append(self._keyframe(context, near.image, turned, KEYFRAME_FEATURES))
        return bank

    def _keyframe(self, context: _Context, image: Image, turned: FloatArray, most: int) -> Keyframe:
        key = (context.row.id, image.id)
        features = self._features.get(key)
        if features is None:
            found = extract_features(decode_image(self._storage.read(image.sha256)))
            camera = Camera(
                context.camera.intrinsics,
                turned @ context.camera.R_cam_from_world,
                context.camera.center_in_world,
            )
            features = found.keep(scenery(found, camera, context.scene)).keep(slice(most))
            self._features[key] = features
            while len(self._features) > FEATURES_KEPT:
                self._features.popitem(last=False)
        self._features.move_to_end(key)
        return Keyframe(image.id, features, turned)

    def _finish(self, reregistration_id: int) -> int:
        session = self._runner.session()
        row = session.get_one(Reregistration, reregistration_id)
        if row.status is not ReregistrationStatus.RUNNING:
            return 0
        passed = repository.images(session, reregistration_id, passed=True, limit=1_000_000)
        estimates = group_pointings(
            [matrix_from_rotvec(image.rotation_from_reference or (0, 0, 0)) for image in passed],
            [np.array(image.covariance) for image in passed],
            float(row.settings["same_pointing_deg"]),
        )
        for position, estimate in enumerate(estimates):
            members = [passed[index] for index in estimate.members]
            pointing = Pointing(
                reregistration_id=row.id,
                reregistration=row,
                position=position,
                rotation_from_reference=rotvec_from_matrix(estimate.R_from_reference).tolist(),
                angle_deg=estimate.angle_deg,
                covariance=estimate.covariance.tolist(),
                first_at=members[0].image.captured_at,
                last_at=members[-1].image.captured_at,
                image_count=len(members),
            )
            repository.add_pointing(session, pointing, [member.image_id for member in members])
        _settle(session, row)
        repository.finish(session, reregistration_id, ReregistrationStatus.SUCCEEDED)
        return len(estimates)


def _settle(session: Session, row: Reregistration) -> None:
    """Decide what needs nobody: what has not moved, and what the asked-for gate accepts."""
    least = row.settings.get("accept_from_inliers")
    session.expire_all()
    for pointing in repository.pointings(session, row.id):
        if accepting.keep_unmoved(session, pointing) or least is None:
            continue
        best = repository.strongest(session, pointing.id)
        if best is None or (best.inliers or 0) < least:
            continue
        try:
            with session.begin_nested():
                accepting.accept(session, pointing, AcceptIn.model_validate({}), None)
        except AppError as error:
            pointing.note = f"not accepted by itself: {error.detail}"


def _context(session: Session, reregistration_id: int) -> _Context:
    row = repository.get(session, reregistration_id)
    if row is None:
        raise Conflict("the re-registration was removed")
    camera, frame = camera_of(session, row.registration_id)
    places = [point.landmark for point in repository.keypoints(session, row.viewport_id)]
    land = [frame.position(at.lat_deg, at.lon_deg, at.height_m) for at in places]
    return _Context(
        row=row,
        reference=row.reference_image,
        camera=camera,
        scene=Scene(
            frame,
            row.viewport.camera.site.water_level_m,
            np.array(land, dtype=np.float64).reshape(-1, 3),
            row.settings.get("nearest_land_m"),
        ),
        gate=Gate(**row.settings["gate"]),
    )


def _helpful(
    row: ReregistrationImage, known: Sequence[ReregistrationImage]
) -> list[ReregistrationImage]:
    """Sort keyframes: the one before in time, the strongest, then those of the same daylight."""
    able = [each for each in known if (each.inliers or 0) >= KEYFRAME_INLIERS]
    if not able:
        return []
    moment = row.image.captured_at

    def apart_s(other: ReregistrationImage) -> float:
        return abs((other.image.captured_at - moment).total_seconds())

    def apart_in_day_s(other: ReregistrationImage) -> float:
        apart = apart_s(other) % DAY_S
        return min(apart, DAY_S - apart)

    ordered = [min(able, key=apart_s), max(able, key=lambda other: other.inliers or 0)]
    ordered += sorted(able, key=apart_in_day_s)
    return list({other.image_id: other for other in ordered}.values())


def _outcome(
    row: ReregistrationImage, turn: Turn, message: str | None, attempt: int
) -> dict[str, Any]:
    refusal = turn.refusal
    turned, covariance = turn.R_from_reference, turn.covariance
    if message is None and refusal is not None:
        message = reregistrations.REFUSALS[refusal]
    return {
        "image_id": row.image_id,
        "refusal": refusal and refusal.value,
        "message": message,
        "rotation_from_reference": None if turned is None else rotvec_from_matrix(turned).tolist(),
        "covariance": None if covariance is None else covariance.tolist(),
        "angle_deg": turn.angle_deg if turned is not None else None,
        "inliers": turn.inliers,
        "hull_share": turn.hull_share,
        "rmse_px": turn.rmse_px,
        "keyframe_ids": list(turn.keyframe_ids),
        "attempts": attempt,
    }


def _as_known(row: ReregistrationImage, outcome: dict[str, Any]) -> ReregistrationImage:
    """Return a row as it will be stored, for the images that follow in the same step."""
    return ReregistrationImage(
        image_id=row.image_id,
        image=row.image,
        rotation_from_reference=outcome["rotation_from_reference"],
        inliers=outcome["inliers"],
    )
