"""A million poses in a minute: rows made by the database itself, from a series of numbers.

Four poses a photograph, one in two graded, numbers with as many digits as real ones have. The same
statements serve SQLite and Postgres.
"""

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.tables.runs import Run
from tests.factories.runs import FIRST_MMSI, Harbour, make_harbour, make_run

POSES_AN_IMAGE = 4
VESSELS = 400


def _series(count: int, *, is_sqlite: bool) -> str:
    if is_sqlite:
        numbers = "WITH RECURSIVE s(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM s WHERE i + 1 < "
        return f"({numbers}{count}) SELECT i FROM s) AS s"  # noqa: S608  a number
    return f"generate_series(0, {count - 1}) AS s(i)"


def _digits(step: int, modulus: int, scale: str, base: float) -> str:
    """Return an expression of a number with about sixteen digits that differs from row to row."""
    return f"({base} + ((i * {step}) % {modulus}) * {scale})"


def _list(*expressions: str) -> str:
    inner = " || ',' || ".join(f"CAST({each} AS TEXT)" for each in expressions)
    return f"'[' || {inner} || ']'"


# Offsets of a box's corners from its middle as a camera sees them, px: no three are in a line.
_OFFSETS_PX = ((-61, 9), (-38, 17), (57, 13), (34, 6), (-59, -24), (-37, -19), (55, -21), (33, -27))


def _corners() -> str:
    pairs = [
        _list(
            _digits(17, 99991, "0.021371934", 200.0 + u_px),
            _digits(13, 99989, "0.011738261", 300.0 + v_px),
        )
        for u_px, v_px in _OFFSETS_PX
    ]
    return "'[' || " + " || ',' || ".join(pairs) + " || ']'"


def fill(session: Session, poses: int) -> tuple[Harbour, Run]:
    """Insert a finished run with so many poses, their photographs, states and verdicts."""
    is_sqlite = session.get_bind().dialect.name == "sqlite"
    harbour = make_harbour(session, images=0)
    images = poses // POSES_AN_IMAGE
    run = make_run(session, harbour, image_count=images)
    first = {
        name: (session.scalar(sa.text(f"SELECT coalesce(max(id), 0) FROM {name}")) or 0) + 1  # noqa: S608  our own names
        for name in ("images", "detection_sets", "detections", "vessel_states", "matches", "poses")
    }
    json = "" if is_sqlite else "::jsonb"
    pad = "substr('0000000000' || CAST(i AS TEXT), -10)" if is_sqlite else "lpad(i::text, 10, '0')"
    sha = f"'{harbour.camera.id:054}' || {pad}"
    moment = (
        "strftime('%Y-%m-%d %H:%M:%S', '2026-01-01', '+' || (i * 20) || ' seconds') || '.000000'"
        if is_sqlite
        else "timestamptz '2026-01-01T00:00:00Z' + i * interval '20 seconds'"
    )
    begun = "'2026-06-01 00:00:00.000000'" if is_sqlite else "timestamptz '2026-06-01T00:00:00Z'"
    false = "0" if is_sqlite else "false"
    image = f"{first['images']} + i / {POSES_AN_IMAGE}"
    vessel = f"{FIRST_MMSI} + (i * 7 % {VESSELS // POSES_AN_IMAGE}) * {POSES_AN_IMAGE} + i % 4"
    lat, lon = _digits(31, 99991, "0.00000011", 53.5), _digits(37, 99991, "0.00000017", 9.9)
    heading = _digits(7, 359999, "0.001", 0)
    statements = {
        "images": (
            images,
            {
                "id": f"{first['images']} + i",
                "site_id": str(harbour.site.id),
                "camera_id": str(harbour.camera.id),
                "viewport_id": str(harbour.viewport.id),
                "sha256": sha,
                "media_type": "'image/jpeg'",
                "file_name": f"'image-' || {pad} || '.jpg'",
                "size_bytes": "1000",
                "width_px": "2560",
                "height_px": "1920",
                "captured_at": moment,
                "captured_at_raw": moment,
                "captured_at_source": "'given'",
                "created_at": begun,
            },
        ),
        "detection_sets": (
            images,
            {
                "id": f"{first['detection_sets']} + i",
                "image_sha256": sha,
                "model_sha256": f"'{harbour.model.sha256}'",
                "settings_sha256": "'settings'",
                "created_at": begun,
            },
        ),
        "detections": (
            poses,
            {
                "id": f"{first['detections']} + i",
                "detection_set_id": f"{first['detection_sets']} + i / {POSES_AN_IMAGE}",
                "x1_px": _digits(17, 99991, "0.0213", 200.0),
                "y1_px": _digits(13, 99989, "0.0117", 300.0),
                "x2_px": _digits(17, 99991, "0.0213", 290.25),
                "y2_px": _digits(13, 99989, "0.0117", 350.5),
                "score": _digits(11, 9973, "0.00005", 0.4),
                "class_id": "8",
            },
        ),
        "vessel_states": (
            poses,
            {
                "id": f"{first['vessel_states']} + i",
                "run_id": str(run.id),
                "image_id": image,
                "mmsi": vessel,
                "lat_deg": lat,
                "lon_deg": lon,
                "heading_deg": heading,
                "heading_source": "'reported'",
                "speed_kn": "5.5",
                "age_s": _digits(3, 61, "0.731", 0.25),
                "to_bow_m": "60",
                "to_stern_m": "20",
                "to_port_m": "6",
                "to_starboard_m": "6",
                "report_ids": f"'[1]'{json}",
                "outcome": "'matched'",
                "segments_px": f"'{{}}'{json}",
            },
        ),
        "matches": (
            poses,
            {
                "id": f"{first['matches']} + i",
                "run_id": str(run.id),
                "detection_id": f"{first['detections']} + i",
                "vessel_state_id": f"{first['vessel_states']} + i",
                "cost": _digits(19, 9967, "0.00004", 0.01),
                "cost_terms": f"'{{}}'{json}",
            },
        ),
        "poses": (
            poses,
            {
                "id": f"{first['poses']} + i",
                "run_id": str(run.id),
                "image_id": image,
                "match_id": f"{first['matches']} + i",
                "mmsi": vessel,
                "lat_deg": lat,
                "lon_deg": lon,
                "center_height_m": _digits(5, 997, "0.0031", 42.0),
                "heading_deg": heading,
                "centroid_in_cam_m": f"({_list(*_place())}){json}",
                "rotvec_cam_from_vessel": f"({_list(*_turn())}){json}",
                "length_m": "80.0",
                "width_m": "12.0",
                "height_m": _digits(23, 9973, "0.00137", 4.0),
                "corners_in_image_px": f"({_corners()}){json}",
                "corrected_segment_px": f"'[]'{json}",
                "correction_in_enu_m": f"({_list(*_place())}){json}",
                "flags": f"'[]'{json}",
                "person_made": false,
                "created_at": begun,
            },
        ),
        "reviews": (
            poses // 2,
            {
                "pose_id": f"{first['poses']} + i * 2",
                "grade": "CASE i % 10 WHEN 0 THEN 'ok' WHEN 1 THEN 'bad' ELSE 'good' END",
                "reasons": f"'[]'{json}",
                "guideline_version": "1",
                "second_opinion": false,
                "settles": false,
                "created_at": begun,
            },
        ),
    }
    for table, (count, columns) in statements.items():
        values = ", ".join(columns.values())
        series = _series(count, is_sqlite=is_sqlite)
        insert = f"INSERT INTO {table} ({', '.join(columns)}) SELECT {values} FROM {series}"  # noqa: S608  our own names
        session.execute(sa.text(insert.replace(":", "\\:")))
    return harbour, run


def _place() -> tuple[str, str, str]:
    return (
        _digits(29, 99991, "0.00107", -50.0),
        _digits(41, 99989, "0.00009", -4.0),
        _digits(43, 99971, "0.0211", 150.0),
    )


def _turn() -> tuple[str, str, str]:
    return (
        _digits(29, 99991, "0.0000107", -0.5),
        _digits(41, 99989, "0.0000309", -1.4),
        _digits(43, 99971, "0.0000211", 0.5),
    )
