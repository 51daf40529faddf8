"""Splitting poses by one property, to see where a pipeline is weak.

Range and heading are told as the camera sees them: metres from the camera along the water, and the
angle between the vessel's bow and the line to the camera, 0 for a vessel that comes straight at it
and 180 for one that shows its stern. A vessel seen end-on hides its length, so that its heading is
hard to judge; far away a metre is a fraction of a pixel.

By reviewer there is no league table: one sees oneself and all others together. Who runs the site
sees everybody, to find out whose measure drifts.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import atan2, degrees, hypot
from typing import TypeVar

from sqlalchemy.orm import Session

from app.ais.ship_types import ship_type_name
from app.domain.local_metres import offset_m
from app.evaluation import review_repository as repository
from app.evaluation.review_repository import PoseRow, Station, Verdict

HEADING_BIN_DEG = 30
HEADING_WORDS = {0: ", bow on", 60: ", broadside", 90: ", broadside", 150: ", stern on"}
UNKNOWN = "unknown"


class By(StrEnum):
    """What poses are split by."""

    TYPE = "type"
    RANGE = "range"
    HEADING = "heading"
    RUN = "run"
    REVIEWER = "reviewer"


@dataclass(frozen=True, slots=True)
class Viewer:
    """Who looks: their own id, and whether they may see each reviewer by name."""

    user_id: int
    sees_people: bool


@dataclass(frozen=True, slots=True)
class Part:
    """Some of the verdicts, and of how many poses; None where poses belong to no one part."""

    key: str
    label: str
    poses: int | None
    verdicts: Sequence[Verdict]


Key = TypeVar("Key", bound=Hashable)


def breakdown(
    session: Session,
    by: By,
    poses: Sequence[PoseRow],
    verdicts: Sequence[Verdict],
    standing: Mapping[int, Verdict],
    viewer: Viewer,
    *,
    bin_m: int,
) -> list[Part]:
    """Split poses and the verdicts that stand for them; by reviewer, all of their verdicts."""
    if by is By.REVIEWER:
        return _by_reviewer(session, verdicts, viewer)
    if by is By.RUN:
        labels = repository.run_labels(session, {pose.run_id for pose in poses})
        return _split(poses, standing, lambda pose: pose.run_id, lambda run_id: labels[run_id])
    if by is By.TYPE:
        types = repository.ship_types(session, (pose.mmsi for pose in poses))
        return _split(
            poses,
            standing,
            lambda pose: _kind(types.get(pose.mmsi)),
            str.capitalize,
        )
    stations = repository.stations(session, {pose.run_id for pose in poses})
    if by is By.RANGE:
        return _split(
            poses,
            standing,
            lambda pose: int(_range_m(pose, stations[pose.run_id]) // bin_m) * bin_m,
            lambda start: f"{start} to {start + bin_m} m",
        )
    return _split(
        poses,
        standing,
        lambda pose: min(
            int(_off_bow_deg(pose, stations[pose.run_id]) // HEADING_BIN_DEG) * HEADING_BIN_DEG,
            180 - HEADING_BIN_DEG,
        ),
        _heading_label,
    )


def _split(
    poses: Iterable[PoseRow],
    standing: Mapping[int, Verdict],
    key_of: Callable[[PoseRow], Key],
    label_of: Callable[[Key], str],
) -> list[Part]:
    """Put poses with the same key together, in the keys' own order."""
    members: dict[Key, list[int]] = {}
    for pose in poses:
        members.setdefault(key_of(pose), []).append(pose.id)
    return [
        Part(
            key=str(key),
            label=label_of(key),
            poses=len(ids),
            verdicts=[standing[pose_id] for pose_id in ids if pose_id in standing],
        )
        for key, ids in sorted(members.items(), key=lambda item: _order(item[0]))
    ]


def _kind(ship_type: int | None) -> str:
    """Name a ship type by its kind alone: the second digit tells hazards, not shapes."""
    name = ship_type_name(ship_type)
    return name.partition(" (")[0] if name else UNKNOWN


def _order(key: Hashable) -> tuple[bool, int, str]:
    """Order numbers by size and texts by letters, what is unknown last."""
    return key == UNKNOWN, key if isinstance(key, int) else 0, str(key)


def _by_reviewer(session: Session, verdicts: Sequence[Verdict], viewer: Viewer) -> list[Part]:
    of_person: dict[int | None, list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.inherited_from_id is None:
            of_person.setdefault(verdict.user_id, []).append(verdict)
    own = Part("you", "You", None, of_person.pop(viewer.user_id, []))
    if not viewer.sees_people:
        others = [verdict for found in of_person.values() for verdict in found]
        return [own, Part("others", "All others together", None, others)]
    names = repository.names(session, [person for person in of_person if person is not None])
    people = [
        Part(str(person or "gone"), names.get(person or 0, "Somebody who left"), None, found)
        for person, found in of_person.items()
    ]
    return [own, *sorted(people, key=lambda part: part.label.casefold())]


def _range_m(pose: PoseRow, camera: Station) -> float:
    return hypot(*_from_camera_m(pose, camera))


def _off_bow_deg(pose: PoseRow, camera: Station) -> float:
    """Return the angle between the bow and the line from vessel to camera, 0 to 180."""
    east_m, north_m = _from_camera_m(pose, camera)
    to_camera_deg = degrees(atan2(-east_m, -north_m))
    return abs((to_camera_deg - pose.heading_deg + 180) % 360 - 180)


def _from_camera_m(pose: PoseRow, camera: Station) -> tuple[float, float]:
    return offset_m(camera.lat_deg, camera.lon_deg, pose.lat_deg, pose.lon_deg)


def _heading_label(start_deg: int) -> str:
    return f"{start_deg} to {start_deg + HEADING_BIN_DEG}°{HEADING_WORDS.get(start_deg, '')}"
