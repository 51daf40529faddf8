"""What verdicts say of a site's images, in the domain's words.

Only images that a person marked complete tell how many boxes show nothing with AIS, and how many
vessels were overlooked; one with a pose that nobody graded says less than it seems, and is left
out. A person's own pose, or another vessel chosen for one, tells what a box shows as well.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

from sqlalchemy.orm import Session

from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.priors import GradedBox, GradedImage, GradedPair, Priors
from app.learning import repository
from app.learning.repository import Box, CompleteImage, Missed, PoseVerdict, Verdict
from app.tables.reviews import Grade, MissedReason

_OURS = frozenset({MatchingMethod.LIKELIHOOD, MatchingMethod.TRACK_VOTES})
_NOBODY_KNOWS_WHO = 0  # a vessel with AIS that a person saw, without saying which
_LEAST_OVERLAP = 0.5
_MISSING_AIS = "missing_ais"
_FALSE_POSITIVE = "false_positive"


def graded_images(session: Session, site_id: int) -> list[GradedImage]:
    """Return all that a site's complete images say, in no order."""
    return list(_images(session, site_id))


def _images(session: Session, site_id: int) -> Iterator[GradedImage]:
    images = repository.complete_images(session, site_id)
    if not images:
        return
    parameters = repository.parameters(session, {image.run_id for image in images})
    verdicts = repository.verdicts(session, site_id)
    chosen = repository.rematched(session, site_id)
    boxes: dict[int, list[Box]] = defaultdict(list)
    for box in repository.boxes(session, site_id):
        boxes[box.detection_set_id].append(box)
    poses: dict[tuple[int, int], list[PoseVerdict]] = defaultdict(list)
    for pose in repository.poses(session, site_id):
        poses[pose.run_id, pose.image_id].append(pose)
    missed: dict[tuple[int, int], list[Missed]] = defaultdict(list)
    for vessel in repository.missed(session, site_id):
        missed[vessel.run_id, vessel.image_id].append(vessel)
    for image in images:
        key = image.run_id, image.image_id
        if all(pose.person_made or pose.id in verdicts for pose in poses[key]):
            yield _graded(
                image,
                parameters[image.run_id],
                boxes[image.detection_set_id],
                [(pose, verdicts.get(pose.id), chosen.get(pose.id)) for pose in poses[key]],
                missed[key],
            )


def _graded(
    image: CompleteImage,
    parameters: Mapping[str, Any],
    boxes: Sequence[Box],
    poses: Sequence[tuple[PoseVerdict, Verdict | None, int | None]],
    missed: Sequence[Missed],
) -> GradedImage:
    shows: dict[int, int] = {}
    wrong: list[Verdict] = []
    pairs: list[GradedPair] = []
    scores = {box.id: box.score for box in boxes}
    matching = MatchingMethod(parameters.get("matching", MatchingMethod.PAPER))
    for pose, verdict, instead in poses:
        right = verdict is None or verdict.grade is not Grade.WRONG
        if right or instead is not None:
            shows[pose.detection_id] = pose.mmsi if instead is None else instead
        elif verdict is not None:
            wrong.append(verdict)
        comparable = matching in _OURS or matching is MatchingMethod.PAPER
        if verdict is not None and comparable and pose.detection_id in scores:
            probability = pose.cost_terms.get("probability") if matching in _OURS else None
            score = scores[pose.detection_id]
            right = right and instead in {None, pose.mmsi}
            pairs.append(GradedPair(score, pose.mmsi, pose.cost, probability, right))
    for vessel in missed:
        if vessel.reason is MissedReason.COST_TOO_HIGH:
            shows |= {box.id: _NOBODY_KNOWS_WHO for box in _under(vessel, boxes)}
    reasons = [vessel.reason for vessel in missed]
    without_ais = sum(_MISSING_AIS in verdict.reasons for verdict in wrong)
    no_vessel = sum(_FALSE_POSITIVE in verdict.reasons for verdict in wrong)
    return GradedImage(
        id=image.image_id,
        at_s=image.captured_at.timestamp(),
        used=_used(parameters),
        boxes=[
            GradedBox(box.score, shows.get(box.id))
            for box in boxes
            if box.score >= parameters.get("score_threshold", 0.0)
        ],
        pairs=pairs,
        not_detected=reasons.count(MissedReason.NOT_DETECTED),
        silent=sum(r in {MissedReason.NO_AIS, MissedReason.NEITHER} for r in reasons) + without_ais,
        visible=len(shows)
        + len(wrong)
        - no_vessel
        + len(missed)
        - reasons.count(MissedReason.COST_TOO_HIGH),
    )


def _used(parameters: Mapping[str, Any]) -> Priors:
    """Return the chances a run took; those it did not store are what runs took then."""
    usual = FusionSettings()
    names = {field.name for field in fields(Priors)} - {"maximum_cost"}
    return Priors(**{name: parameters.get(name, getattr(usual, name)) for name in names})


def _under(vessel: Missed, boxes: Sequence[Box]) -> Iterator[Box]:
    """Give the box that a person's box of a missed vessel lies on."""
    for box in boxes:
        wide = min(vessel.x2_px, box.x2_px) - max(vessel.x1_px, box.x1_px)
        high = min(vessel.y2_px, box.y2_px) - max(vessel.y1_px, box.y1_px)
        common = max(0.0, wide) * max(0.0, high)
        both = sum((b.x2_px - b.x1_px) * (b.y2_px - b.y1_px) for b in (vessel, box)) - common
        if common >= _LEAST_OVERLAP * both:
            yield box
            return
