"""The same few poses for every writer: graded or not, whole or partly behind the camera."""

from datetime import UTC, datetime

from app.exports.writers.records import ImageRecord, PoseRecord, ReviewRecord, Selection

MORNING = ImageRecord(
    id=41,
    file_name="20220714_102030.jpg",
    sha256="ab" * 32,
    width_px=2560,
    height_px=1920,
    captured_at=datetime(2022, 7, 14, 10, 20, 30, tzinfo=UTC),
)
NOON = ImageRecord(
    id=57,
    file_name='Süd \u2028 "5".png',
    sha256="cd" * 32,
    width_px=2560,
    height_px=1920,
    captured_at=datetime(2022, 7, 14, 12, 0, 0, 250000, tzinfo=UTC),
)
TURNED = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]
CORNERS = [[100.5 + i, 200.25 - i] for i in range(8)]


def pose(
    identifier: int, image: ImageRecord, vessel: str, review: ReviewRecord | None, **changes: object
) -> PoseRecord:
    """Return a pose, with some fields changed."""
    fields: dict[str, object] = {
        "id": identifier,
        "run_id": 3,
        "registration_id": 2,
        "image": image,
        "vessel": vessel,
        "box_px": (100.0, 150.5, 300.0, 210.0),
        "score": 0.875,
        "cost": 0.0625,
        "centroid_in_cam_m": [12.5, -3.25, 317.0],
        "rotation_cam_from_vessel": TURNED,
        "rotvec_cam_from_vessel": [1.2, -1.2, 1.2],
        "lat_deg": 53.5422,
        "lon_deg": 9.9835,
        "center_height_m": 4.5,
        "heading_deg": 271.5,
        "heading_source": "reported",
        "report_age_s": 7.0,
        "length_m": 29.0,
        "width_m": 8.0,
        "height_m": 11.375,
        "corners_in_image_px": CORNERS,
        "correction_in_enu_m": [0.5, -0.25, 2.5],
        "flags": ["cut_left"],
        "review": review,
    }
    return PoseRecord(**(fields | changes))  # type: ignore[arg-type]  each has its field's type


GOOD = ReviewRecord("good", [], 1, datetime(2022, 7, 15, 8, 0, tzinfo=UTC))
BAD = ReviewRecord("bad", ["height", "other"], 1, datetime(2022, 7, 15, 8, 1, tzinfo=UTC))
POSES = [
    pose(101, MORNING, "f3a9c2d4e5b60718", GOOD),
    pose(102, MORNING, "0011223344556677", BAD, flags=[], score=0.5),
    pose(
        230,
        NOON,
        "f3a9c2d4e5b60718",
        None,
        corners_in_image_px=[None, *CORNERS[1:]],
        heading_source="course",
    ),
]
IMAGES = [MORNING, NOON]
SELECTION = Selection(
    filters={"grade": ["good", "bad"], "run_id": 3},
    anonymised=True,
    remains="times and places",
    runs=[
        {
            "id": 3,
            "preset": "paper",
            "parameters": {"maximum_cost": 0.5},
            "detector": "yolox-nano",
            "detector_sha256": "ef" * 32,
            "registration_id": 2,
            "code_version": "1.2.3",
        }
    ],
    code_version="1.2.3",
    pose_count=3,
)
