"""The poses of an export as writers get them: read again at every pass, a few thousand at a time.

Which poses there are is known by id beforehand, so that every pass, part and scene is a list of
ids, and all of it is of one moment: the transaction of one session.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson
from sqlalchemy.orm import Session

from app.domain.rotations import matrices_from_rotvecs
from app.exports import record_repository as repository
from app.exports.identities import Identities
from app.exports.selection_repository import Chosen, Ids
from app.exports.verdict_repository import counted_reviews
from app.exports.writers.records import (
    Frame,
    ImageRecord,
    PoseRecord,
    StateRecord,
    ViewRecord,
)

POSES_AT_ONCE = 2000
IMAGES_AT_ONCE = 400
Photograph = Callable[[ImageRecord], Iterator[bytes]]


@dataclass(frozen=True, slots=True)
class Context:
    """What is the same for all poses: cameras by run, identities by site, what is asked for."""

    session: Session
    views: Mapping[int, ViewRecord]
    identities: Mapping[int, Identities]
    verdict: str
    corrected: bool
    part_of: Callable[[int, int], str] | None
    photograph: Photograph | None
    gone: Callable[[], Iterator[int]]
    manifest: Callable[["Reading"], Mapping[str, object]]
    advanced: Callable[[int], None]


class Reading:
    """A source (see `writers.records.Source`) over chosen poses; `only` is a part's name."""

    def __init__(
        self, context: Context, chosen: Chosen, parts: Sequence[str] = (), only: str | None = None
    ) -> None:
        self._context = context
        self.chosen = chosen
        self.parts = parts
        self.only = only
        self.grades: Mapping[str | None, int] | None = None
        self._manifest: Mapping[str, object] | None = None

    def part(self, name: str) -> "Reading":
        """Return the poses of one part."""
        part_of = self._context.part_of or _everywhere
        pairs = zip(self.chosen.image_ids.tolist(), self.chosen.mmsis.tolist(), strict=True)
        mask = np.fromiter((part_of(*pair) == name for pair in pairs), bool, len(self))
        return Reading(self._context, _where(self.chosen, mask), (), name)

    def __len__(self) -> int:
        return len(self.chosen.pose_ids)

    def images(self) -> Iterator[ImageRecord]:
        """Give the photographs, by id."""
        ids = np.unique(self.chosen.image_ids)
        site_of = self._sites_of_images(ids)
        for start in range(0, len(ids), POSES_AT_ONCE):
            some = ids[start : start + POSES_AT_ONCE].tolist()
            found = repository.images(self._context.session, some)
            for image_id in some:
                yield self._named(found[image_id], site_of(image_id))

    def poses(self) -> Iterator[PoseRecord]:
        """Give the poses, by id; when all are given, `grades` counts them."""
        ids = self.chosen.pose_ids
        grades: Counter[str | None] = Counter()
        for start in range(0, len(ids), POSES_AT_ONCE):
            end = start + POSES_AT_ONCE
            images = np.unique(self.chosen.image_ids[start:end]).tolist()
            for pose in self._records(ids[start:end].tolist(), images):
                grades[None if pose.review is None else pose.review.grade] += 1
                yield pose
            self._context.advanced(min(end, len(ids)))
        self.grades = grades

    def gone(self) -> Iterator[int]:
        """Give the ids that changed since a moment and are no longer selected."""
        return self._context.gone()

    def views(self) -> Sequence[ViewRecord]:
        """Return the cameras as registered, by registration."""
        runs = np.unique(self.chosen.run_ids).tolist()
        views = {self._context.views[run].registration_id: self._context.views[run] for run in runs}
        return [views[registration] for registration in sorted(views)]

    def frames(
        self, registration_id: int | None = None, *, states: bool = False
    ) -> Iterator[Frame]:
        """Give the photographs of a registration (None: of all) with their poses, in order."""
        for view in self.views():
            if registration_id in {None, view.registration_id}:
                yield from self._frames(view, states=states)

    def photograph(self, image: ImageRecord) -> Iterator[bytes] | None:
        """Give a photograph's bytes; None where photographs are left out."""
        give = self._context.photograph
        return None if give is None else give(image)

    def manifest(self) -> Mapping[str, object]:
        """Return what the selection is and where it comes from."""
        if self._manifest is None:
            self._manifest = self._context.manifest(self)
        return self._manifest

    def _frames(self, view: ViewRecord, *, states: bool) -> Iterator[Frame]:
        runs = [run for run, seen in self._context.views.items() if seen is view]
        chosen = _where(self.chosen, np.isin(self.chosen.run_ids, runs))
        order = np.argsort(chosen.image_ids, kind="stable")
        images, starts = np.unique(chosen.image_ids[order], return_index=True)
        ends = np.append(starts[1:], len(order))
        for start in range(0, len(images), IMAGES_AT_ONCE):
            some = images[start : start + IMAGES_AT_ONCE].tolist()
            end = min(start + IMAGES_AT_ONCE, len(images))
            ids = np.sort(chosen.pose_ids[order[starts[start] : ends[end - 1]]])
            of_image: dict[int, list[PoseRecord]] = {image_id: [] for image_id in some}
            for pose in self._records(ids.tolist(), some):
                of_image[pose.image.id].append(pose)
            found = repository.states(self._context.session, runs, some) if states else {}
            for image_id, poses in of_image.items():
                afloat = self._states(found.get(image_id, ()), view.site_id)
                yield Frame(view, poses[0].image, poses, afloat)
            self._context.advanced(int(ends[end - 1]))

    def _states(self, rows: Sequence[Any], site_id: int) -> list[StateRecord]:
        """Return each vessel's state once, though several runs may have kept it."""
        told = self._context.identities[site_id]
        states = {row.mmsi: StateRecord(told.vessel(row.mmsi), *row[3:]) for row in rows}
        return list(states.values())

    def _records(self, pose_ids: Sequence[int], image_ids: Sequence[int]) -> Iterator[PoseRecord]:
        """Put poses together; what a person corrected takes the place of what was generated."""
        context = self._context
        session = context.session
        rows = repository.pose_rows(session, pose_ids)
        details = [orjson.loads(row[22]) for row in rows]
        reviews = counted_reviews(session, pose_ids, context.verdict)
        corrections = repository.corrections(session, pose_ids) if context.corrected else {}
        for number, row in enumerate(rows):
            corrected = corrections.get(row[0])
            if corrected is not None:
                details[number][:2] = corrected.centroid_in_cam_m, corrected.rotvec_cam_from_vessel
        rotations = matrices_from_rotvecs([detail[1] for detail in details]).tolist()
        images = repository.images(session, image_ids)
        named: set[int] = set()
        for row, detail, rotation in zip(rows, details, rotations, strict=True):
            view = context.views[row[1]]
            told = context.identities[view.site_id]
            image = images[row[2]]
            if image.id not in named:
                named.add(image.id)
                self._named(image, view.site_id)
            pose = PoseRecord(
                row[0],
                row[1],
                view,
                image,
                told.vessel(row[3]),
                row[4:8],
                row[8],
                row[9],
                detail[0],
                rotation,
                detail[1],
                row[10],
                row[11],
                row[12],
                row[13],
                row[14],
                row[15],
                row[16],
                row[17],
                row[18],
                detail[2],
                detail[3],
                detail[4],
                row[19],
                row[20],
                detail[5],
                reviews.get(row[0]),
                "person_made" if row[21] else "generated",
            )
            if context.part_of is not None:
                pose.part = context.part_of(image.id, row[3])
            corrected = corrections.get(row[0])
            if corrected is not None:
                _put_right(pose, corrected)
                pose.vessel = told.vessel(corrected.mmsi)
            yield pose

    def _named(self, image: ImageRecord, site_id: int) -> ImageRecord:
        told = self._context.identities[site_id]
        image.file_name = told.file_name(image.file_name, image.sha256)
        return image

    def _sites_of_images(self, image_ids: Ids) -> Callable[[int], int]:
        """Return what tells a photograph's site; a run's photographs are of its site."""
        _, first = np.unique(self.chosen.image_ids, return_index=True)
        runs = self.chosen.run_ids[first]

        def site_of(image_id: int) -> int:
            run = int(runs[np.searchsorted(image_ids, image_id)])
            return self._context.views[run].site_id

        return site_of


def _everywhere(_image_id: int, _mmsi: int) -> str:
    return "all"


def _where(chosen: Chosen, mask: np.ndarray[Any, np.dtype[np.bool_]]) -> Chosen:
    return Chosen(
        chosen.pose_ids[mask], chosen.image_ids[mask], chosen.run_ids[mask], chosen.mmsis[mask]
    )


def _put_right(pose: PoseRecord, corrected: repository.Corrected) -> None:
    """Put a person's box in place of the generated one; how sure that one was says nothing now."""
    pose.source = corrected.kind
    pose.lat_deg, pose.lon_deg = corrected.lat_deg, corrected.lon_deg
    pose.center_height_m, pose.heading_deg = corrected.center_height_m, corrected.heading_deg
    pose.length_m, pose.width_m = corrected.length_m, corrected.width_m
    pose.height_m = corrected.height_m
    pose.corners_in_image_px = corrected.corners_in_image_px
    pose.flags = corrected.flags
    pose.position_covariance_in_enu_m2 = None
    pose.heading_sigma_deg = pose.height_sigma_m = None
    if corrected.cost is not None:
        pose.cost = corrected.cost
    if corrected.kind == "edited":
        pose.heading_source = "person"
