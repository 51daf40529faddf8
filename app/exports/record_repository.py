"""SQL of what an export writes of its poses: by primary key, a few thousand at a time.

Rows are the driver's own tuples, because a million of anything else costs seconds. JSON columns
come as texts.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.exports.driver_rows import driver_rows
from app.exports.id_lists import among, near
from app.exports.writers.batches import Corrected, PoseColumns
from app.stand_ins import FIRST_STAND_IN, STAND_INS
from app.tables.ais import Vessel
from app.tables.detection import Detection
from app.tables.imagery import Image
from app.tables.reviews import Correction
from app.tables.runs import Match, Pose, VesselStateRow

_poses, _matches, _boxes, _states, _images = (
    each.__table__.c for each in (Pose, Match, Detection, VesselStateRow, Image)
)
_corrections = Correction.__table__.c


def _json_text(column: sa.ColumnElement[Any]) -> sa.ColumnElement[str]:
    """Return a JSON column's text; what is not there is null."""
    return sa.func.coalesce(sa.cast(column, sa.Text), sa.literal("null", sa.Text))


_OF_POSE = (
    _poses.id,
    _poses.match_id,
    _poses.run_id,
    _poses.image_id,
    _poses.mmsi,
    _poses.lat_deg,
    _poses.lon_deg,
    _poses.center_height_m,
    _poses.heading_deg,
    _poses.length_m,
    _poses.width_m,
    _poses.height_m,
    _poses.heading_sigma_deg,
    _poses.height_sigma_m,
    _poses.person_made,
    *map(
        _json_text,
        (
            _poses.centroid_in_cam_m,
            _poses.rotvec_cam_from_vessel,
            _poses.corners_in_image_px,
            _poses.correction_in_enu_m,
            _poses.position_covariance_in_enu_m2,
            _poses.flags,
        ),
    ),
)
_OF_MATCH = (_matches.id, _matches.detection_id, _matches.vessel_state_id, _matches.cost)
_OF_BOX = (_boxes.id, _boxes.x1_px, _boxes.y1_px, _boxes.x2_px, _boxes.y2_px, _boxes.score)
_OF_STATE = (_states.id, _states.heading_source, _states.age_s)
_JOINED = sa.select(*_OF_POSE, *_OF_MATCH, *_OF_BOX, *_OF_STATE).select_from(
    Pose.__table__.join(Match.__table__, _matches.id == _poses.match_id)
    .join(Detection.__table__, _boxes.id == _matches.detection_id)
    .join(VesselStateRow.__table__, _states.id == _matches.vessel_state_id)
)


def pose_columns(session: Session, pose_ids: Sequence[int]) -> PoseColumns | None:
    """Return poses by id; None where none of them is there.

    Postgres gives each table by itself, since the ids are neighbours: joining them costs it as much
    again as all else. SQLite is quicker with a join.
    """
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    statement = _JOINED if is_sqlite else sa.select(*_OF_POSE)
    columns = _columns(session, statement, among(_poses.id, pose_ids), pose_ids)
    if not columns:
        return None
    ids, match_ids, run_ids, image_ids, mmsis, *of_pose = columns[: len(_OF_POSE)]
    beside = columns[len(_OF_POSE) :]
    if not beside:
        matches = _columns_of(session, sa.select(*_OF_MATCH), match_ids)
        _, box_ids, state_ids, _ = matches
        boxes = _columns_of(session, sa.select(*_OF_BOX), box_ids)
        beside = [*matches, *boxes, *_columns_of(session, sa.select(*_OF_STATE), state_ids)]
    _, _, _, costs, _, *box, scores, _, heading_sources, ages_s = beside
    return PoseColumns._make(
        (
            *(ids, run_ids, image_ids, mmsis),
            *(*box, scores, costs),
            *of_pose[:4],
            *(heading_sources, ages_s),
            *of_pose[4:],
        )
    )


def _columns(
    session: Session,
    statement: sa.Select[Any],
    condition: sa.ColumnElement[bool],
    ids: Sequence[int],
) -> list[tuple[Any, ...]]:
    """Return by column the rows that are there of some ids in order; nothing where none is."""
    rows = driver_rows(session, statement.where(condition).order_by(statement.selected_columns[0]))
    columns = list(zip(*rows, strict=True))
    if not columns or columns[0] == tuple(ids):
        return columns
    wanted = set(ids)
    return list(zip(*(row for row in rows if row[0] in wanted), strict=True))


def _columns_of(
    session: Session, statement: sa.Select[Any], ids: Sequence[int]
) -> list[tuple[Any, ...]]:
    """Return by column the rows of ids, all of which are there, in any order."""
    in_order = sorted(set(ids))
    condition = near(statement.selected_columns[0], in_order)
    columns = _columns(session, statement, condition, in_order)
    if columns[0] == tuple(ids):
        return columns
    rows = dict(zip(in_order, zip(*columns, strict=True), strict=True))
    return list(zip(*map(rows.__getitem__, ids), strict=True))


def images(session: Session, image_ids: Sequence[int]) -> Sequence[Any]:
    """Return rows of photographs by id (see `image_record`), under their own names."""
    return driver_rows(
        session,
        sa.select(
            _images.id,
            _images.file_name,
            _images.sha256,
            _images.width_px,
            _images.height_px,
            _images.captured_at,
            _images.camera_id,
            _images.media_type,
        )
        .where(among(_images.id, image_ids))
        .order_by(_images.id),
    )


def corrections(session: Session, pose_ids: Sequence[int]) -> dict[int, Corrected]:
    """Return the newest corrections of some poses, unless they are deleted."""
    rows = session.execute(
        sa.select(
            _corrections.pose_id,
            _corrections.deleted_at.is_(None),
            sa.cast(_corrections.kind, sa.Text),
            _corrections.mmsi,
            _corrections.lat_deg,
            _corrections.lon_deg,
            _corrections.center_height_m,
            _corrections.heading_deg,
            _corrections.length_m,
            _corrections.width_m,
            _corrections.height_m,
            _corrections.cost,
            _json_text(_corrections.centroid_in_cam_m),
            _json_text(_corrections.rotvec_cam_from_vessel),
            _json_text(_corrections.corners_in_image_px),
            _json_text(_corrections.flags),
        )
        .where(among(_corrections.pose_id, pose_ids))
        .order_by(_corrections.version)
    )
    newest = {row[0]: row for row in rows}
    return {pose_id: Corrected(*row[2:]) for pose_id, row in newest.items() if row[1]}


def states(
    session: Session, run_ids: Sequence[int], image_ids: Sequence[int]
) -> Mapping[int, Sequence[Any]]:
    """Return the vessel states of some photographs in some runs, by photograph."""
    rows = session.execute(
        sa.select(
            _states.image_id,
            _states.run_id,
            _states.mmsi,
            _states.lat_deg,
            _states.lon_deg,
            _states.heading_deg,
            _states.speed_kn,
            _states.age_s,
            _states.to_bow_m,
            _states.to_stern_m,
            _states.to_port_m,
            _states.to_starboard_m,
        )
        .where(_states.run_id.in_(run_ids), among(_states.image_id, image_ids))
        .order_by(_states.id)
    )
    found: dict[int, list[Any]] = {}
    for row in rows:
        found.setdefault(row[0], []).append(row)
    return found


def vessel_names(session: Session, mmsis: Sequence[int]) -> Iterator[tuple[int, str | None]]:
    """Give (MMSI, name) of vessels, a vessel nobody heard the name of included."""
    vessels = Vessel.__table__.c
    names: dict[int, str | None] = {}
    for start in range(0, len(mmsis), 1000):
        some = mmsis[start : start + 1000]
        rows = session.execute(
            sa.select(vessels.mmsi, vessels.name).where(among(vessels.mmsi, some))
        )
        names |= {row[0]: row[1] for row in rows}
    for mmsi in mmsis:
        yield mmsi, names.get(mmsi)


def stand_ins(session: Session) -> Sequence[tuple[int, str | None]]:
    """Return (number, name) of the vessels whose numbers stand for a published identifier."""
    vessels = Vessel.__table__.c
    rows = session.execute(
        sa.select(vessels.mmsi, vessels.name).where(
            vessels.mmsi.between(FIRST_STAND_IN, FIRST_STAND_IN + STAND_INS - 1)
        )
    )
    return [(row[0], row[1]) for row in rows]


def posed(session: Session) -> Sequence[int]:
    """Return all vessels that have a pose, in order: from one to the next along the index."""
    first = sa.select(sa.func.min(_poses.mmsi).label("mmsi")).cte("posed", recursive=True)
    after = sa.select(sa.func.min(_poses.mmsi)).where(_poses.mmsi > first.c.mmsi)
    each = first.union_all(
        sa.select(after.correlate(first).scalar_subquery()).where(first.c.mmsi.is_not(None))
    )
    return session.scalars(sa.select(each.c.mmsi).where(each.c.mmsi.is_not(None))).all()


def rematched(session: Session) -> Sequence[int]:
    """Return the vessels that people chose instead of others."""
    return session.scalars(sa.select(_corrections.mmsi).distinct()).all()
