"""The same few poses for every writer: graded or not, whole or partly behind the camera."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.domain.rotations import matrix_from_rotvec
from app.exports.writers.batches import Lines
from app.exports.writers.pose_table import PoseTable
from app.exports.writers.records import (
    Frame,
    ImageRecord,
    PoseRecord,
    ReviewRecord,
    StateRecord,
    ViewRecord,
)

MORNING = ImageRecord(
    id=41,
    file_name="20220714_102030.jpg",
    sha256="ab" * 32,
    width_px=2560,
    height_px=1920,
    captured_at="2022-07-14T10:20:30Z",
)
NOON = ImageRecord(
    id=57,
    file_name='Süd \u2028 "5".png',
    sha256="cd" * 32,
    width_px=2560,
    height_px=1920,
    captured_at="2022-07-14T12:00:00.250000Z",
    suffix=".png",
)
VIEW = ViewRecord(
    registration_id=2,
    viewport_id=5,
    camera_id=4,
    site_id=1,
    width_px=2560,
    height_px=1920,
    K=[[2000.0, 0.0, 1279.5], [0.0, 2010.0, 959.5], [0.0, 0.0, 1.0]],
    distortion=[0.0] * 5,
    R_cam_from_ecef=[[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
    center_ecef_m=[3740818.5, 658498.25, 5106656.75],
    water_level_m=40.5,
)
SIGNS = np.array([[x, y, z] for z in (-1, 1) for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))])


def pose(
    identifier: int, image: ImageRecord, vessel: str, review: ReviewRecord | None, **changes: object
) -> PoseRecord:
    """Return an upright box seen by a camera that looks a little down, with some fields changed."""
    # Forward, port and up of a vessel abeam, seen by a camera pitched by 0.1 rad and rolled a bit.
    tilt = matrix_from_rotvec([0.1, 0.0, 0.02])
    rotation = tilt @ matrix_from_rotvec([np.pi / 2, 0.0, 0.0]) @ matrix_from_rotvec([0, 0, 0.4])
    center, size = np.array([12.5, -3.25, 317.0]), np.array([29.0, 8.0, 11.375])
    in_cam = (SIGNS * size / 2) @ rotation.T + center
    projected = in_cam @ np.array(VIEW.K).T
    fields: dict[str, object] = {
        "id": identifier,
        "run_id": 3,
        "view": VIEW,
        "image": image,
        "vessel": vessel,
        "box_px": (100.0, 150.5, 300.0, 210.0),
        "score": 0.875,
        "cost": 0.0625,
        "centroid_in_cam_m": center.tolist(),
        "rotation_cam_from_vessel": np.round(rotation, 12).tolist(),
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
        "corners_in_image_px": np.round(projected[:, :2] / projected[:, 2:], 9).tolist(),
        "correction_in_enu_m": [0.5, -0.25, 2.5],
        "position_covariance_in_enu_m2": [[4.0, 0.5, 0.0], [0.5, 9.0, 0.0], [0.0, 0.0, 0.25]],
        "heading_sigma_deg": 2.5,
        "height_sigma_m": None,
        "flags": ["cut_left"],
        "review": review,
    }
    return PoseRecord(**(fields | changes))  # type: ignore[arg-type]  each has its field's type


GOOD = ReviewRecord("good", [], 1, "2022-07-15T08:00:00Z")
BAD = ReviewRecord("bad", ["height", "other"], 1, "2022-07-15T08:01:00Z")
POSE = pose(101, MORNING, "f3a9c2d4e5b60718", GOOD)
POSES = [
    POSE,
    pose(102, MORNING, "0011223344556677", BAD, flags=[], score=0.5),
    pose(
        230,
        NOON,
        "f3a9c2d4e5b60718",
        None,
        corners_in_image_px=[None, *POSE.corners_in_image_px[1:]],
        heading_source="course",
        length_m=31.0,
        part="val",
    ),
]
STATES = [
    StateRecord("f3a9c2d4e5b60718", 53.5421, 9.98351, 271.5, 9.7, 1.5, 20.0, 9.0, 4.0, 4.0),
    StateRecord("unmatched", 53.6, 9.9, 12.0, 0.0, 30.25, 5.0, 5.0, 2.0, 2.5),
]
MANIFEST: dict[str, object] = {
    "format": "any",
    "filters": {"grade": ["good", "bad"], "run_id": 3},
    "options": {"images": True, "archive": False},
    "anonymised": True,
    "remains": "times and places",
    "part": None,
    "split": None,
    "counts": {
        "poses": 3,
        "images": 2,
        "vessels": 2,
        "grades": {"good": 1, "ok": 0, "bad": 1, "wrong": 0, "ungraded": 1},
    },
    "runs": [
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
    "registrations": [
        {
            "id": 2,
            "viewport_id": 5,
            "method": "pnp",
            "mae_px": 3.14159,
            "mae_pct_width": 0.12,
            "mae_pct_height": 0.16,
        }
    ],
    "ais_files": [{"id": 1, "file_name": "elbe|*.csv", "sha256": "12" * 32}],
    "matching": None,
    "code_version": "1.2.3",
}


def table_of(first: int, poses: Sequence[PoseRecord]) -> PoseTable:
    """Return records as a table."""
    return PoseTable(
        first=first,
        ids=[pose.id for pose in poses],
        run_ids=[pose.run_id for pose in poses],
        registration_ids=[pose.view.registration_id for pose in poses],
        viewport_ids=[pose.view.viewport_id for pose in poses],
        images=[pose.image for pose in poses],
        vessels=[pose.vessel for pose in poses],
        boxes_px=[pose.box_px for pose in poses],
        scores=[pose.score for pose in poses],
        costs=[pose.cost for pose in poses],
        centroids_in_cam_m=[pose.centroid_in_cam_m for pose in poses],
        rotations_cam_from_vessel=np.array([pose.rotation_cam_from_vessel for pose in poses]),
        rotvecs_cam_from_vessel=[pose.rotvec_cam_from_vessel for pose in poses],
        lats_deg=[pose.lat_deg for pose in poses],
        lons_deg=[pose.lon_deg for pose in poses],
        center_heights_m=[pose.center_height_m for pose in poses],
        headings_deg=[pose.heading_deg for pose in poses],
        heading_sources=[pose.heading_source for pose in poses],
        report_ages_s=[pose.report_age_s for pose in poses],
        lengths_m=[pose.length_m for pose in poses],
        widths_m=[pose.width_m for pose in poses],
        heights_m=[pose.height_m for pose in poses],
        corners_in_image_px=[pose.corners_in_image_px for pose in poses],
        corrections_in_enu_m=[pose.correction_in_enu_m for pose in poses],
        position_covariances_in_enu_m2=[p.position_covariance_in_enu_m2 for p in poses],
        heading_sigmas_deg=[pose.heading_sigma_deg for pose in poses],
        height_sigmas_m=[pose.height_sigma_m for pose in poses],
        flags=[pose.flags for pose in poses],
        reviews=[pose.review for pose in poses],
        sources=[pose.source for pose in poses],
        parts=[pose.part for pose in poses],
    )


@dataclass
class Records:
    """A source of records that are all in memory."""

    all_poses: Sequence[PoseRecord]
    parts: Sequence[str] = ()
    with_photographs: bool = False
    gone_ids: Sequence[int] = ()

    def part(self, name: str) -> "Records":
        """Return the poses of one part."""
        return replace(self, all_poses=[p for p in self.all_poses if p.part == name], parts=())

    def images(self) -> Iterator[ImageRecord]:
        """Give the photographs, by id."""
        found = {each.image.id: each.image for each in self.all_poses}
        for number, image_id in enumerate(sorted(found), start=1):
            found[image_id].number = number
            yield found[image_id]

    def poses(self) -> Iterator[PoseRecord]:
        """Give the poses."""
        yield from self.all_poses

    def __len__(self) -> int:
        return len(self.all_poses)

    def lines(self, write: Lines) -> Iterator[bytes]:
        """Give what a writer makes of the poses, two at a time."""
        for first in range(0, len(self.all_poses), 2):
            yield write(table_of(first, self.all_poses[first : first + 2]))

    def gone(self) -> Iterator[int]:
        """Give the ids that are gone."""
        yield from self.gone_ids

    def views(self) -> Sequence[ViewRecord]:
        """Return the cameras."""
        found = {each.view.registration_id: each.view for each in self.all_poses}
        return [found[registration_id] for registration_id in sorted(found)]

    def frames(
        self, registration_id: int | None = None, *, states: bool = False
    ) -> Iterator[Frame]:
        """Give the photographs with their poses."""
        for view in self.views():
            if registration_id in {None, view.registration_id}:
                for image in self.images():
                    poses = [each for each in self.all_poses if each.image is image]
                    yield Frame(view, image, poses, STATES if states else ())

    def photograph(self, image: ImageRecord) -> Iterator[bytes] | None:
        """Give a photograph's bytes."""
        return iter([b"a photograph of ", image.sha256.encode()]) if self.with_photographs else None

    def manifest(self) -> Mapping[str, object]:
        """Return the manifest."""
        return MANIFEST


SOURCE = Records(POSES, with_photographs=True)
