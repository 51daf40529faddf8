"""Whether a run's images can be believed in time: looked at when it ends, by their vessels.

Nobody asks for this, so it must cost next to nothing where the clock is right: then the matches
themselves say so, and no report is read again. Only where they do not is the offset searched for.
Matches made by a clock that is off are withheld, and the offset is proposed for a person to apply.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from math import cos, radians, sin
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.clocks import repository
from app.clocks.repository import DetectedImage, MatchedBox
from app.domain.camera import Camera
from app.domain.clock_offset import (
    OffsetEstimate,
    OffsetSettings,
    TimedPair,
    estimate_parts,
    matches_agree,
    timed_pair,
)
from app.domain.clock_sight import TimedImage
from app.domain.geodesy import EnuFrame
from app.domain.local_metres import moved
from app.imagery.true_time import CLOCK_SOURCES
from app.registration.service import camera_of
from app.runs.parameters import fusion_settings
from app.runs.service import get_run
from app.runs.withholding_repository import withhold
from app.sites.water import level_at
from app.tables.clock import ClockEstimate, EstimateStatus
from app.tables.runs import Run
from app.tables.sites import Site
from worker.tasks.vessel_paths import boxes_of, paths_around

IMAGES_TOGETHER = 120  # of one time: a clock that was set meanwhile is found from block to block
IMAGES_SEARCHED = 40
_KN = 1852 / 3600
_SAME_S = 3.0  # neighbouring blocks that differ by less tell of one offset


@dataclass(frozen=True, slots=True)
class Suspicion:
    """Images whose clock is off, and by how much: true time = the clock + the estimate's offset.

    `applied_s` was applied already when the run was made.
    """

    images: Sequence[DetectedImage]
    found: OffsetEstimate
    applied_s: float

    def joined(self, later: "Suspicion") -> "Suspicion | None":
        """Return what both say where they tell of one offset, by the surer one; else None."""
        if abs(self.found.offset_s - later.found.offset_s) > _SAME_S:
            return None
        surer = min(self, later, key=lambda one: one.found.high_s - one.found.low_s)
        return Suspicion([*self.images, *later.images], surer.found, surer.applied_s)


def suspicions(session: Session, run_id: int, first: int) -> list[Suspicion]:
    """Return what is to be doubted of a run's images from a position on."""
    run = get_run(session, run_id)
    image_ids = repository.image_ids_from(session, run_id, first, IMAGES_TOGETHER)
    found: list[Suspicion] = []
    for block in _blocks(image_ids):
        for doubted in _suspicions(session, run, repository.detected_on(session, run_id, block)):
            joined = found[-1].joined(doubted) if found else None
            found[-1:] = [joined] if joined else [*found[-1:], doubted]
    return found


def act_on(session: Session, run_id: int, doubted: Sequence[Suspicion]) -> None:
    """Withhold what is doubted, and propose the offsets."""
    run = get_run(session, run_id)
    is_open = repository.is_standing(session, run_id)
    for number, suspicion in enumerate(doubted):
        images = [one.image for one in suspicion.images]
        begin = min(image.captured_at_raw for image in images)
        last = max(image.captured_at_raw for image in images)
        repository.forget_suspicions(session, run_id, begin)
        withheld = withhold(session, run_id, [image.id for image in images])
        row = ClockEstimate(
            camera_id=images[0].camera_id,
            run_id=run_id,
            begin=begin,
            # A live camera's clock goes on as it is; a card that was read is all there is.
            end=None if is_open else last + timedelta(seconds=1),
            status=EstimateStatus.SUCCEEDED,
            workflow_id=f"{run.workflow_id}-clock-{number}",
            result=_result(suspicion, withheld),
        )
        session.add(row)
        session.flush()


def _result(suspicion: Suspicion, withheld: int) -> dict[str, Any]:
    result = asdict(suspicion.found)
    for name in ("offset_s", "low_s", "high_s"):
        result[name] += suspicion.applied_s
    return result | {
        "withheld_images": len(suspicion.images),
        "withheld_matches": withheld,
        "concerns_given": any(
            one.image.captured_at_source not in CLOCK_SOURCES for one in suspicion.images
        ),
    }


def _blocks(image_ids: Sequence[int]) -> Iterator[Sequence[int]]:
    """Yield images of one time, counted from the last: a run that grows has its newest complete."""
    last = len(image_ids)
    for start in range(last % IMAGES_TOGETHER - IMAGES_TOGETHER, last, IMAGES_TOGETHER):
        block = image_ids[max(start, 0) : start + IMAGES_TOGETHER]
        if block:
            yield block


def _suspicions(session: Session, run: Run, block: Sequence[DetectedImage]) -> Iterator[Suspicion]:
    """Yield what is to be doubted of a block, by each time between which the clock was set."""
    settings = OffsetSettings()
    fusion = fusion_settings(run.preset, run.parameters)
    site = session.get_one(Site, run.site_id)
    camera, frame = camera_of(session, run.registration_id)
    step = -(-len(block) // IMAGES_SEARCHED)
    # Many good images hide newer ones whose clock went wrong.
    looked_at = (block, block[-IMAGES_SEARCHED:]) if step > 1 else (block,)
    if all(_agree(session, run, camera, frame, images) for images in looked_at):
        return
    searched = block[::step]
    images = [
        TimedImage(
            one.image.captured_at.timestamp(),
            camera,
            level_at(session, site, one.image.captured_at).level_m,
            boxes_of(one, fusion),
        )
        for one in searched
    ]
    paths = paths_around(session, site, frame, searched, settings, fusion)
    for part in estimate_parts(images, paths, settings):
        if part.estimate.is_suspect:
            doubted = block[part.first * step : part.last * step]
            applied_s = [
                _applied_s(one.image.captured_at, one.image.captured_at_raw) for one in doubted
            ]
            yield Suspicion(doubted, part.estimate, float(np.median(applied_s)))


def _agree(
    session: Session,
    run: Run,
    camera: Camera,
    frame: EnuFrame,
    images: Sequence[DetectedImage],
) -> bool:
    """Whether the matches on some images show that their clock is right."""
    fusion = fusion_settings(run.preset, run.parameters)
    site = session.get_one(Site, run.site_id)
    matched = repository.matched_boxes(session, run.id, [one.image.id for one in images])
    level_m = level_at(session, site, images[0].image.captured_at).level_m
    pairs = _pairs(camera, frame, level_m, matched)
    detections = sum(len(boxes_of(one, fusion)) for one in images)
    return matches_agree(pairs, detections, OffsetSettings())


def _applied_s(moment: datetime, raw: datetime) -> float:
    return (moment - raw).total_seconds()


def _pairs(
    camera: Camera, frame: EnuFrame, level_m: float, matched: Sequence[MatchedBox]
) -> list[TimedPair]:
    """Return how late the vessels seem that a run has matched."""
    ends_deg = [
        place
        for one in matched
        for place in (
            (one.lat_deg, one.lon_deg),
            moved(one.lat_deg, one.lon_deg, *_step_m(one)),
        )
    ]
    lat_deg, lon_deg = np.array(ends_deg).reshape(-1, 2).T
    ends, _ = frame.places(lat_deg, lon_deg, level_m)
    u_px = camera.project(ends)[:, 0].reshape(-1, 2).tolist()
    px_per_m = camera.px_per_m(ends).reshape(-1, 2).max(axis=1)
    pairs = (
        timed_pair(one.box, one.centre_px, after - before, one.mmsi, scale)
        for one, (before, after), scale in zip(matched, u_px, px_per_m.tolist(), strict=True)
    )
    return [pair for pair in pairs if pair is not None]


def _step_m(one: MatchedBox) -> tuple[float, float]:
    """Return a second's way of a vessel, east and north."""
    heading = radians(one.heading_deg)
    way_m = one.speed_kn * _KN
    return way_m * sin(heading), way_m * cos(heading)
