"""The poses of an export as writers get them: read again at every pass, a few thousand at a time.

Which poses there are is known by id beforehand, so that every pass, part and scene is a list of
ids, and all of it is of one moment: the transaction of one session.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.exports import record_repository as repository
from app.exports.second_hand import SecondHand, cores
from app.exports.selection_repository import Chosen, Ids
from app.exports.truth_repository import boxes_drawn
from app.exports.verdict_repository import counted_reviews
from app.exports.writers.batches import Batch, Lines, lines_of, put_right, records_of
from app.exports.writers.records import (
    Frame,
    Identities,
    ImageRecord,
    PoseRecord,
    StateRecord,
    ViewRecord,
)
from app.exports.writers.stored_values import image_record
from app.garbage import collection_paused

POSES_AT_ONCE = 2000
MANY = 50_000  # poses that take longer than another process takes to begin
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

    def first(self, count: int) -> "Reading":
        """Return the first poses alone."""
        mask = np.arange(len(self)) < count
        return Reading(self._context, _where(self.chosen, mask), self.parts, self.only)

    def __len__(self) -> int:
        return len(self.chosen.pose_ids)

    @cached_property
    def image_ids(self) -> Ids:
        """The photographs, in order."""
        return np.unique(self.chosen.image_ids)

    def images(self) -> Iterator[ImageRecord]:
        """Give the photographs, by id."""
        ids = self.image_ids
        site_of = self._sites_of_images(ids)
        told = self._context.identities
        for start in range(0, len(ids), POSES_AT_ONCE):
            some = ids[start : start + POSES_AT_ONCE].tolist()
            rows = repository.images(self._context.session, some)
            for number, row in enumerate(rows, start=start + 1):
                yield image_record(row, number, told[site_of(row[0])])

    def poses(self) -> Iterator[PoseRecord]:
        """Give the poses, by id; when all are given, `grades` counts them."""
        for batch in self._batches():
            yield from records_of(batch)

    def lines(self, write: Lines) -> Iterator[bytes]:
        """Give what a writer makes of the poses; of many, another process makes it meanwhile."""
        if len(self) < MANY or cores() < 2:
            for batch in self._batches():
                yield lines_of(batch, write)
            return
        with SecondHand(write, self._context.identities) as hand:
            yield from hand.written(self._batches())

    def _batches(self) -> Iterator[Batch]:
        ids = self.chosen.pose_ids
        grades: Counter[str | None] = Counter()
        for start in range(0, len(ids), POSES_AT_ONCE):
            end = start + POSES_AT_ONCE
            images = np.unique(self.chosen.image_ids[start:end]).tolist()
            batch = self._batch(start, ids[start:end].tolist(), images)
            if batch is not None:
                # The first row of a pose counts: put in backwards, it is put in last.
                graded = {row[0]: row[1] for row in reversed(batch.reviews)}
                grades.update(graded.values())
                grades[None] += len(batch.columns.id) - len(graded)
                yield batch
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
            batch = self._batch(0, ids.tolist(), some)
            for pose in records_of(batch) if batch else ():
                of_image[pose.image.id].append(pose)
            session = self._context.session
            found = repository.states(session, runs, some) if states else {}
            boxes = boxes_drawn(session, some) if states else {}
            for image_id, poses in of_image.items():
                afloat = self._states(found.get(image_id, ()), view.site_id)
                yield Frame(view, poses[0].image, poses, afloat, boxes.get(image_id))
            self._context.advanced(int(ends[end - 1]))

    def _states(self, rows: Sequence[Any], site_id: int) -> list[StateRecord]:
        """Return each vessel's state once, though several runs may have kept it."""
        told = self._context.identities[site_id]
        states = {row.mmsi: StateRecord(told.vessel(row.mmsi), *row[3:]) for row in rows}
        return list(states.values())

    def _batch(self, first: int, pose_ids: Sequence[int], image_ids: Sequence[int]) -> Batch | None:
        """Read poses; None where there are none."""
        with collection_paused():
            context = self._context
            columns = repository.pose_columns(context.session, pose_ids)
            if columns is None:
                return None
            numbers = np.searchsorted(self.image_ids, image_ids) + 1
            parts = context.part_of and list(map(context.part_of, columns.image_id, columns.mmsi))
            if context.corrected:
                columns = put_right(columns, repository.corrections(context.session, pose_ids))
            return Batch(
                first=first,
                columns=columns,
                views={run: context.views[run] for run in set(columns.run_id)},
                images=repository.images(context.session, image_ids),
                numbers=numbers.tolist(),
                reviews=counted_reviews(context.session, columns.id, context.verdict),
                parts=parts,
                told=context.identities,
            )

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
