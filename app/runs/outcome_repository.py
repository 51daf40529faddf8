"""SQL that stores what came of a batch's images: vessel states, matches and poses.

They hang together by ids that the database gives. SQLite, which is in our process, is asked for
them between the tables. Postgres gets all rows of a batch in one statement, as two JSON texts: it
makes rows of them and finds the ids itself, in a third of the time of a statement a row.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql
from sqlalchemy.orm import Session

from app.db import Base, json_text, now
from app.domain.detection import Detection as DetectedBox
from app.sites.water import Level
from app.tables.detection import Detection
from app.tables.runs import Match, Pose, VesselStateRow

_Rows: TypeAlias = Sequence[Mapping[str, Any]]
# Rows by the thousand go past the mapping to objects.
_STATES, _MATCHES, _POSES = (
    Base.metadata.tables[row.__tablename__] for row in (VesselStateRow, Match, Pose)
)
# What a row of a pose tells of its match.
_OF_MATCH = ("detection_id", "cost", "cost_terms")


@dataclass(frozen=True, slots=True)
class PoseRows:
    """The rows of one pose, still without the ids the database gives.

    It is of the vessel state of its image with the same MMSI.
    """

    detection_index: int
    cost: float
    cost_terms: dict[str, float]
    pose: dict[str, Any]


@dataclass(frozen=True, slots=True)
class ImageOutcome:
    """What came of one image: boxes, vessel states and poses, or the reason why nothing did."""

    image_id: int
    image_sha256: str
    detection_set_id: int | None
    new_boxes: Sequence[DetectedBox] | None
    states: Sequence[dict[str, Any]]
    poses: Sequence[PoseRows]
    error: str | None = None
    water: Level | None = None


def store_poses(
    session: Session, run_id: int, outcomes: Sequence[ImageOutcome], set_ids: Mapping[str, int]
) -> None:
    """Store the vessel states, matches and poses of some images.

    `set_ids` are those of the images' sets of detections, by image content.
    """
    states = [
        {"image_id": outcome.image_id, **state} for outcome in outcomes for state in outcome.states
    ]
    if not states:
        return
    with_poses = [outcome for outcome in outcomes if outcome.poses]
    box_ids = _detection_ids(session, [set_ids[one.image_sha256] for one in with_poses])
    poses = [
        {
            "image_id": outcome.image_id,
            "detection_id": box_ids[set_ids[outcome.image_sha256]][rows.detection_index],
            "cost": rows.cost,
            "cost_terms": rows.cost_terms,
            **rows.pose,
        }
        for outcome in with_poses
        for rows in outcome.poses
    ]
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    (_insert_each if is_sqlite else _insert_at_once)(session, run_id, states, poses)


def _insert_at_once(session: Session, run_id: int, states: _Rows, poses: _Rows) -> None:
    """Insert into all tables in one statement of Postgres."""
    given = {
        "run_id": run_id,
        "created_at": now(),
        "states": json_text([{"place": place, **row} for place, row in enumerate(states)]),
        "poses": json_text([{"place": place, **row} for place, row in enumerate(poses)]),
    }
    session.execute(_statement(tuple(states[0]), tuple(poses[0]) if poses else ()), given)


@cache
def _statement(state_names: tuple[str, ...], pose_names: tuple[str, ...]) -> sa.Insert:
    """Return the statement for rows of these columns, those of poses with their matches'."""
    run_id = sa.bindparam("run_id", type_=sa.Integer())
    of_match = [name for name in pose_names if name in _OF_MATCH]
    of_pose = [name for name in pose_names if name not in _OF_MATCH]
    state = _records("states", [_STATES.c[name] for name in state_names])
    insert_states = (
        sa.insert(_STATES)
        .from_select(
            ["run_id", *state_names],
            sa.select(run_id, *_values(state, _STATES, state_names)).order_by(state.c.place),
            include_defaults=False,
        )
        .returning(_STATES.c.id, _STATES.c.image_id, _STATES.c.mmsi)
    )
    if not pose_names:
        return insert_states
    stored_state = insert_states.cte("stored_state")
    columns = [_MATCHES.c[name] for name in of_match] + [_POSES.c[name] for name in of_pose]
    pose = _records("poses", columns)
    is_of_pose = sa.and_(
        stored_state.c.image_id == pose.c.image_id, stored_state.c.mmsi == pose.c.mmsi
    )
    stored_match = (
        sa.insert(_MATCHES)
        .from_select(
            ["run_id", "vessel_state_id", *of_match],
            sa.select(run_id, stored_state.c.id, *_values(pose, _MATCHES, of_match))
            .join_from(pose, stored_state, is_of_pose)
            .order_by(pose.c.place),
            include_defaults=False,
        )
        .returning(_MATCHES.c.id, _MATCHES.c.vessel_state_id)
        .cte("stored_match")
    )
    created_at = sa.bindparam("created_at", type_=_POSES.c.created_at.type)
    return sa.insert(_POSES).from_select(
        ["run_id", "created_at", "match_id", *of_pose],
        sa.select(run_id, created_at, stored_match.c.id, *_values(pose, _POSES, of_pose))
        .join_from(pose, stored_state, is_of_pose)
        .join(stored_match, stored_match.c.vessel_state_id == stored_state.c.id)
        .order_by(pose.c.place),
        include_defaults=False,
    )


def _records(name: str, columns: Sequence[sa.Column[Any]]) -> sa.TableValuedAlias:
    """Return a JSON text that is given as a table of these columns and each row's place."""
    text = sa.cast(sa.bindparam(name, type_=sa.Text()), postgresql.JSON())
    typed = [sa.column(column.name, column.type) for column in columns]
    rows = sa.func.json_to_recordset(text).table_valued(sa.column("place", sa.Integer()), *typed)
    return rows.render_derived(name=f"given_{name}", with_types=True)


def _values(
    rows: sa.TableValuedAlias, table: sa.Table, names: Sequence[str]
) -> list[sa.ColumnElement[Any]]:
    """Return columns of rows as SQLAlchemy stores them: of JSON what is empty is JSON's null."""
    null: sa.ColumnElement[Any] = sa.literal_column("'null'::jsonb")
    return [
        sa.func.coalesce(rows.c[name], null)
        if isinstance(table.c[name].type, sa.JSON)
        else rows.c[name]
        for name in names
    ]


def _insert_each(session: Session, run_id: int, states: _Rows, poses: _Rows) -> None:
    """Insert a table after the other, which SQLite does without leaving the process.

    Ids are asked for afterwards: to be told each as it is inserted takes a statement a row.
    """
    session.execute(sa.insert(_STATES), [{"run_id": run_id, **state} for state in states])
    if not poses:
        return
    state_ids = _state_ids(session, run_id, [pose["image_id"] for pose in poses])
    matches: list[dict[str, Any]] = [
        {
            "run_id": run_id,
            "vessel_state_id": state_ids[pose["image_id"], pose["mmsi"]],
            **{name: pose[name] for name in _OF_MATCH},
        }
        for pose in poses
    ]
    session.execute(sa.insert(_MATCHES), matches)
    match_ids = _match_ids(session, run_id, [match["vessel_state_id"] for match in matches])
    created_at = now()
    session.execute(
        sa.insert(_POSES),
        [
            {
                "run_id": run_id,
                "created_at": created_at,
                "match_id": match_ids[match["vessel_state_id"]],
                **{name: value for name, value in pose.items() if name not in _OF_MATCH},
            }
            for pose, match in zip(poses, matches, strict=True)
        ],
    )


def _state_ids(
    session: Session, run_id: int, image_ids: Collection[int]
) -> Mapping[tuple[int, int], int]:
    """Return the ids of a run's vessel states on some images, by image and MMSI."""
    states = _STATES.c
    rows = session.execute(
        sa.select(states.image_id, states.mmsi, states.id).where(
            states.run_id == run_id, states.image_id.in_(set(image_ids))
        )
    )
    return {(image_id, mmsi): state_id for image_id, mmsi, state_id in rows}


def _match_ids(session: Session, run_id: int, state_ids: Collection[int]) -> Mapping[int, int]:
    """Return the ids of a run's matches of states that were stored together, by vessel state."""
    matches = _MATCHES.c
    rows = session.execute(
        sa.select(matches.vessel_state_id, matches.id).where(
            matches.run_id == run_id,
            matches.vessel_state_id.between(min(state_ids), max(state_ids)),
        )
    )
    return {row[0]: row[1] for row in rows}


def _detection_ids(session: Session, set_ids: Iterable[int]) -> Mapping[int, Sequence[int]]:
    """Return the ids of the boxes of each set, in the order they were found in."""
    rows = session.execute(
        sa.select(Detection.detection_set_id, Detection.id)
        .where(Detection.detection_set_id.in_(set(set_ids)))
        .order_by(Detection.id)
    )
    ids: dict[int, list[int]] = defaultdict(list)
    for set_id, identifier in rows:
        ids[set_id].append(identifier)
    return ids
