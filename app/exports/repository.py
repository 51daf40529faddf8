"""SQL of exports: the requests, and the poses they select."""

from collections.abc import Iterable, Iterator, Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session, defer, joinedload, lazyload, load_only

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.ais import Vessel
from app.tables.exports import Export, ExportStatus
from app.tables.imagery import Image
from app.tables.reviews import Correction, Grade, Review, verdict_order
from app.tables.runs import Match, Pose, Run, VesselStateRow

POSES_AT_ONCE = 500
_NEEDED = (
    defer(Pose.corrected_segment_px),
    joinedload(Pose.match).options(
        load_only(Match.cost),
        joinedload(Match.detection),
        joinedload(Match.vessel_state).load_only(
            VesselStateRow.heading_source, VesselStateRow.age_s
        ),
    ),
)


def get(session: Session, export_id: int) -> Export | None:
    """Return an export."""
    return find(session, Export, export_id)


def listed(
    session: Session, user_id: int | None, paging: Paging
) -> tuple[Sequence[Export], str | None]:
    """Return a page of a person's exports (None: everybody's)."""
    statement = sa.select(Export)
    if user_id is not None:
        statement = statement.where(Export.created_by_id == user_id)
    return fetch_page(session, statement, Export.id, paging)


def newest(session: Session, user_id: int | None, limit: int) -> Sequence[Export]:
    """Return the newest exports of a person (None: of everybody)."""
    statement = sa.select(Export).order_by(Export.id.desc()).limit(limit)
    if user_id is not None:
        statement = statement.where(Export.created_by_id == user_id)
    return session.scalars(statement).all()


def hold_still(session: Session) -> None:
    """Let all reads of a new session see one moment, whatever a run writes meanwhile.

    On SQLite every reading transaction does.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.connection(execution_options={"isolation_level": "REPEATABLE READ"})


class PoseSelection:
    """The poses that an export's filters select, in the order of their ids.

    Those of deleted images are never among them.
    """

    def __init__(
        self,
        *,
        site_ids: Iterable[int] | None,
        run_id: int | None,
        site_id: int | None,
        camera_id: int | None,
        grades: Sequence[str] | None,
        corrected: bool = False,
    ) -> None:
        self._corrected = corrected
        conditions: list[sa.ColumnElement[bool]] = [Image.deleted_at.is_(None)]
        if site_ids is not None:
            conditions.append(Run.site_id.in_(list(site_ids)))
        if run_id is not None:
            conditions.append(Pose.run_id == run_id)
        if site_id is not None:
            conditions.append(Run.site_id == site_id)
        if camera_id is not None:
            conditions.append(Image.camera_id == camera_id)
        if grades:
            conditions.append(_standing_grade().in_([Grade(grade) for grade in grades]))
        self._conditions = conditions

    def _joined(self, statement: sa.Select[int]) -> sa.Select[int]:
        return (
            statement.select_from(Pose)
            .join(Run, Run.id == Pose.run_id)
            .join(Image, Image.id == Pose.image_id)
            .where(*self._conditions)
        )

    def count(self, session: Session) -> int:
        """Return how many poses are selected."""
        return session.scalar(self._joined(sa.select(sa.func.count(Pose.id)))) or 0

    def images(self, session: Session) -> Sequence[Image]:
        """Return the photographs of the selected poses, by id."""
        chosen = self._joined(sa.select(Pose.image_id))
        return session.scalars(
            sa.select(Image).where(Image.id.in_(chosen)).order_by(Image.id)
        ).all()

    def runs(self, session: Session) -> Sequence[Run]:
        """Return the runs of the selected poses, by id."""
        chosen = self._joined(sa.select(Pose.run_id))
        return session.scalars(
            sa.select(Run).options(joinedload(Run.model)).where(Run.id.in_(chosen)).order_by(Run.id)
        ).all()

    def vessels(self, session: Session) -> Sequence[tuple[int, str | None]]:
        """Return (MMSI, name) of the vessels of the selected poses, by MMSI."""
        chosen = self._mmsis().subquery()
        rows = session.execute(
            sa.select(chosen.c.mmsi, Vessel.name)
            .outerjoin(Vessel, Vessel.mmsi == chosen.c.mmsi)
            .order_by(chosen.c.mmsi)
        )
        return [(row[0], row[1]) for row in rows]

    def _mmsis(self) -> sa.Select[int] | sa.CompoundSelect[int]:
        generated = self._joined(sa.select(Pose.mmsi.label("mmsi")).distinct())
        if not self._corrected:
            return generated
        poses = self._joined(sa.select(Pose.id))
        rematched = sa.select(Correction.mmsi).where(Correction.pose_id.in_(poses))
        return sa.union(generated, rematched)

    def poses(self, session: Session) -> Iterator[tuple[Pose, Review | None, Correction | None]]:
        """Give the selected poses with the verdicts and corrections that count, by the hundred.

        Of a pose, its match and its state only what files hold is loaded; of its image and run
        nothing, as `images` and `runs` give them.
        """
        after = 0
        while True:
            chosen = self._joined(sa.select(Pose.id)).where(Pose.id > after)
            ids = session.scalars(chosen.order_by(Pose.id).limit(POSES_AT_ONCE)).all()
            if not ids:
                return
            after = ids[-1]
            found = session.scalars(
                sa.select(Pose).options(*_NEEDED).where(Pose.id.in_(ids)).order_by(Pose.id)
            ).all()
            reviews: dict[int, Review] = {}
            for review in session.scalars(
                sa.select(Review)
                .options(lazyload(Review.user))
                .where(Review.pose_id.in_(ids), Review.replaced_at.is_(None))
                .order_by(*verdict_order())
            ):
                reviews.setdefault(review.pose_id, review)
            corrections = _corrections(session, ids) if self._corrected else {}
            for pose in found:
                yield pose, reviews.get(pose.id), corrections.get(pose.id)
            session.expunge_all()


def _corrections(session: Session, pose_ids: Sequence[int]) -> dict[int, Correction]:
    """Return the newest corrections of poses, unless they are deleted."""
    rows = session.scalars(
        sa.select(Correction)
        .options(lazyload(Correction.user))
        .where(Correction.pose_id.in_(pose_ids))
        .order_by(Correction.version)
    )
    newest = {correction.pose_id: correction for correction in rows}
    return {pose_id: found for pose_id, found in newest.items() if found.deleted_at is None}


def _standing_grade() -> sa.ScalarSelect[Grade]:
    return (
        sa.select(Review.grade)
        .where(Review.pose_id == Pose.id, Review.replaced_at.is_(None))
        .order_by(*verdict_order())
        .limit(1)
        .correlate(Pose)
        .scalar_subquery()
    )


def set_status(session: Session, export_id: int, status: ExportStatus, **columns: object) -> None:
    """Change where an export stands, unless it was cancelled."""
    session.execute(
        sa.update(Export)
        .where(Export.id == export_id, Export.status != ExportStatus.CANCELLED)
        .values(status=status, **columns)
    )


def id_of_job(session: Session, workflow_id: str) -> int | None:
    """Return the export behind a job."""
    return session.scalar(sa.select(Export.id).where(Export.workflow_id == workflow_id))
