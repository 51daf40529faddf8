"""Pulls of what changed: whatever is done, a copy that is kept by pulls equals a whole export."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.clocks import service as clocks
from app.db import Database, now
from app.deletions import service as deletions
from app.exports.selection_repository import OVERLAP
from app.imagery import service as imagery
from app.imports import service as imports
from app.reviews import corrections, grading
from app.runs import growth_repository, withholding_repository
from app.runs.service import get_run
from app.tables.clock import ClockOffset, OffsetSource
from app.tables.identity import User
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.imports import ImageImport, ImportStatus
from app.tables.reviews import Correction, Grade, Review
from app.tables.runs import Pose, RemovedPose, Run
from app.tables.sites import Camera, Site
from tests.factories.imagery import NOON
from tests.factories.runs import FIRST_MMSI, Harbour, make_pose, make_run, make_vessel
from tests.factories.sites import make_camera
from tests.integration.exports.test_corrected_exports import correction
from tests.integration.exports.test_export_selection import lines_of

DECISION = "the first word"


@dataclass
class World:
    """Three photographs with three, one and one poses, and two people."""

    session: Session
    harbour: Harbour
    run_id: int
    poses: list[int]
    ada: User
    ben: User
    batch_id: int
    other_camera_id: int

    def image(self, place: int) -> Image:
        """Return a photograph, also a deleted one."""
        return self.session.get_one(
            Image, self.harbour.images[place].id, execution_options={"with_deleted": True}
        )

    def run(self) -> Run:
        """Return the run."""
        return get_run(self.session, self.run_id)

    def present(self) -> set[int]:
        """Return the poses that nothing hides."""
        return set(
            self.session.scalars(
                sa.select(Pose.id)
                .join(Image, Image.id == Pose.image_id)
                .join(Run, Run.id == Pose.run_id)
            )
        )

    def delete(self, entity: str, entity_id: int) -> set[int]:
        """Delete something; returns the poses that went with it."""
        before = self.present()
        deletions.delete(self.session, entity, [entity_id], site_id=None, label="gone")
        return before - self.present()

    def restore(self, entity: str, entity_id: int) -> set[int]:
        """Bring something back; returns the poses that came with it."""
        before = self.present()
        found = deletions.deletion_of(self.session, entity, entity_id)
        assert found is not None
        deletions.restore(self.session, found)
        return self.present() - before


def _grade(world: World, who: User, grade: Grade, decision: str | None = None) -> set[int]:
    verdict = grading.Verdict(grade=grade, decision=decision)
    grading.grade_pose(world.session, world.poses[0], who.id, verdict)
    return {world.poses[0]}


def _words(world: World, reasons: list[str] | None, comment: str | None = None) -> None:
    grading.add_words(
        world.session,
        world.ada.id,
        DECISION,
        reasons=reasons,
        comment=comment,
        sets_comment=comment is not None,
    )


def _reasons(world: World) -> set[int]:
    _words(world, ["position"])
    return {world.poses[0]}


def _same_reasons(world: World) -> set[int]:
    _words(world, ["position"])
    return set()


def _comment(world: World) -> set[int]:
    _words(world, None, "Look at the stern")
    return {world.poses[0]}


def _withdraw(world: World) -> set[int]:
    grading.withdraw(world.session, world.ada.id, DECISION)
    return {world.poses[0]}


def _make(world: World) -> set[int]:
    pose = make_pose(world.session, world.run(), world.image(1), FIRST_MMSI + 5)
    return {pose.id}


def _correct(world: World) -> set[int]:
    pose = world.session.get_one(Pose, world.poses[1])
    world.session.add(correction(pose, 1, world.ada))
    return {world.poses[1]}


def _uncorrect(world: World) -> set[int]:
    corrections.delete(world.session, corrections.lock(world.session, world.poses[1]))
    return {world.poses[1]}


def _set_clock(world: World) -> set[int]:
    offset = ClockOffset(
        camera_id=world.harbour.camera.id,
        valid_until=NOON + timedelta(seconds=90),
        offset_s=7.0,
        source=OffsetSource.GIVEN,
        concerns_given=True,
    )
    assert clocks.add_offset(world.session, offset) == 2
    return world.present() - {world.poses[4]}


def _set_clock_back(world: World) -> set[int]:
    (offset,) = clocks.history(world.session, world.harbour.camera.id)
    clocks.undo(world.session, offset)
    return world.present() - {world.poses[4]}


def _upload_again(world: World) -> set[int]:
    image = world.image(1)
    before = world.present()
    incoming = imagery.Incoming(
        site_id=image.site_id,
        camera_id=image.camera_id,
        sha256=image.sha256,
        media_type=image.media_type,
        file_name="again.jpg",
        size_bytes=image.size_bytes,
        width_px=image.width_px,
        height_px=image.height_px,
        captured_at=image.captured_at,
        captured_at_source=CaptureTimeSource.GIVEN,
    )
    imagery.remember(world.session, incoming)
    return world.present() - before


def _move_batch(world: World, camera_id: int) -> set[int]:
    before = world.present()
    batch = world.session.get_one(ImageImport, world.batch_id)
    imports.move(world.session, batch, world.session.get_one(Camera, camera_id))
    return before ^ world.present()


def _withhold(world: World) -> set[int]:
    image = world.image(0)
    withholding_repository.withhold(world.session, world.run_id, [image.id])
    return set(world.poses[:3])


def _fuse_again(world: World) -> set[int]:
    before = world.present()
    growth_repository.forget_outcome(world.session, world.run_id, [world.image(1).id])
    world.session.expire_all()
    make_pose(world.session, world.run(), world.image(1), FIRST_MMSI + 6)
    return before ^ world.present() | {max(world.present())}


def _what_no_line_tells(world: World) -> set[int]:
    site = world.session.get_one(Site, world.harbour.site.id)
    site.water_level_m += 1
    site.shows_pseudonyms = True
    world.session.get_one(Camera, world.harbour.camera.id).name = "Another name"
    make_vessel(world.session, FIRST_MMSI, "GESINE")
    return set()


def _of(entity: str, name: str) -> tuple[Callable[[World], set[int]], Callable[[World], set[int]]]:
    """Return what deletes and restores one thing of the harbour."""

    def entity_id(world: World) -> int:
        found: Any = {"image": world.harbour.images[2], "run": world}.get(
            entity, getattr(world.harbour, name, None)
        )
        return int(found.run_id if entity == "run" else found.id)

    return (
        lambda world: world.delete(entity, entity_id(world)),
        lambda world: world.restore(entity, entity_id(world)),
    )


ACTS: list[tuple[str, Callable[[World], set[int]]]] = [
    ("nothing", lambda _: set()),
    ("a pose is made", _make),
    ("graded", lambda world: _grade(world, world.ada, Grade.BAD, DECISION)),
    ("reasons added", _reasons),
    ("the same reasons again", _same_reasons),
    ("a comment", _comment),
    ("a second opinion", lambda world: _grade(world, world.ben, Grade.GOOD)),
    ("the first word taken back", _withdraw),
    ("corrected", _correct),
    ("correction taken back", _uncorrect),
    ("clock set", _set_clock),
    ("clock set back", _set_clock_back),
    *(
        (f"{entity} {done}", act)
        for entity in ("image", "run", "viewport", "camera", "site")
        for done, act in zip(("deleted", "restored"), _of(entity, entity), strict=True)
    ),
    ("image deleted", lambda world: world.delete("image", world.image(1).id)),
    ("uploaded again", _upload_again),
    ("batch moved", lambda world: _move_batch(world, world.other_camera_id)),
    ("batch moved back", lambda world: _move_batch(world, world.harbour.camera.id)),
    ("what no line tells", _what_no_line_tells),
    ("matches withheld", _withhold),
    ("fused again", _fuse_again),
]


def test_a_copy_kept_by_pulls_equals_a_whole_export(
    database: Database, harbour: Harbour, make_user: Callable[..., User]
) -> None:
    """After every kind of change a pull holds what was touched, what went, and nothing else."""
    ada, ben = make_user("reviewer"), make_user("reviewer")
    with database.writing() as session:
        run_id = make_run(session, harbour, [3, 1, 1]).id
        poses = list(session.scalars(sa.select(Pose.id).order_by(Pose.id)))
        camera = make_camera(session, session.get_one(Site, harbour.site.id))
        batch = ImageImport(
            site_id=harbour.site.id,
            camera_id=harbour.camera.id,
            name="card",
            times={},
            status=ImportStatus.COMMITTED,
        )
        session.add(batch)
        session.flush()
        session.get_one(Image, harbour.images[2].id).import_id = batch.id
        batch_id, other_camera_id = batch.id, camera.id
    asked = {"poses": "corrected", "run_id": run_id}
    copy = {line["id"]: line for line in lines_of(database, **asked)}
    assert lines_of(database, **asked, updated_since="0001-01-01T00:00:00Z") == [*copy.values()]
    for name, act in ACTS:
        since = _age(database)
        with database.writing() as session:
            world = World(session, harbour, run_id, poses, ada, ben, batch_id, other_camera_id)
            touched = act(world)
        lines = lines_of(database, **asked, updated_since=since.isoformat())
        whole = {line["id"]: line for line in lines_of(database, **asked)}
        pulled = {line["id"]: line for line in lines if line["type"] == "pose"}
        gone = {line["id"] for line in lines if line["type"] == "gone"}
        assert pulled.keys() == touched & whole.keys(), name
        assert gone == touched - whole.keys(), name
        copy = {key: line for key, line in copy.items() if key not in gone} | pulled
        assert copy == whole, name


def _age(database: Database) -> Any:
    """Let all that was done be long ago; returns a moment between then and now."""
    past, since = now() - timedelta(days=9), now() - timedelta(days=1) + OVERLAP
    marks = [
        *((Pose, column) for column in ("created_at", "changed_at")),
        *((Review, column) for column in ("created_at", "replaced_at", "words_at")),
        *((Correction, column) for column in ("created_at", "deleted_at")),
        (Image, "changed_at"),
        (Run, "changed_at"),
        (RemovedPose, "removed_at"),
    ]
    with database.writing() as session:
        for table, name in marks:
            column = getattr(table, name)
            session.execute(
                sa.update(table).where(column > past).values({name: past}),
                execution_options={"synchronize_session": False},
            )
    return since
