"""Another vessel for a detection: who could it be, and the pose computed anew for the one chosen.

The cost alone decides in a run, within a limit. A person who sees the photograph may know better:
the vessel they choose goes through the same fusion without that limit. For a pose it becomes a
correction; for a detection without a pose it becomes a pose of its own, marked as a person's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from app.domain.arrays import FloatArray
from app.domain.camera import Camera
from app.domain.candidates import Candidate, UnmatchedReason, candidate_or_reason
from app.domain.detection import Detection
from app.domain.fusion import FusedPose, fuse
from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.geodesy import EnuFrame
from app.domain.matching import Cost, matching_cost
from app.domain.vessel_state import HeadingSource, TrackMethod, VesselState
from app.errors import Conflict, FieldError, Invalid, NotFound
from app.registration.service import camera_of
from app.reviews import correction_repository as repository
from app.reviews import run_images
from app.runs import service as runs
from app.runs.parameters import fusion_settings
from app.runs.pose_columns import pixels, pose_columns
from app.sites import service as sites
from app.tables.ais import Vessel
from app.tables.detection import Detection as DetectionRow
from app.tables.imagery import Image
from app.tables.reviews import Correction, CorrectionKind
from app.tables.runs import Match, Pose, Run, VesselStateRow

REASONS: Mapping[UnmatchedReason, str] = {
    UnmatchedReason.NO_POSITION: "its position is not known",
    UnmatchedReason.NO_HEADING: "its heading is not known",
    UnmatchedReason.REPORT_TOO_OLD: "its last report is too old",
    UnmatchedReason.OUT_OF_RANGE: "it is too far away",
    UnmatchedReason.BEHIND_CAMERA: "it is behind the camera",
    UnmatchedReason.OUTSIDE_IMAGE: "it is beside the picture",
    UnmatchedReason.SIZE_UNKNOWN: "its size is not known, so there is no box",
    UnmatchedReason.NO_DETECTION_LEFT: "its cost has no number",
    UnmatchedReason.COST_TOO_HIGH: "its cost has no number",
}


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What a run saw an image with, without its limit of cost and score."""

    run: Run
    image: Image
    camera: Camera
    frame: EnuFrame
    water_level_m: float
    settings: FusionSettings


@dataclass(frozen=True, slots=True, eq=False)
class Offered:
    """A vessel that a detection may show, with its cost and its plane segment in the image."""

    state: VesselStateRow
    vessel: Vessel | None
    pose_id: int | None
    cost: Cost
    segment_px: FloatArray
    rectangle_px: FloatArray


@dataclass(frozen=True, slots=True)
class Refused:
    """A vessel that cannot be what a detection shows, and why."""

    state: VesselStateRow
    vessel: Vessel | None
    reason: UnmatchedReason


def scene_of(session: Session, run_id: int, image: Image) -> Scene:
    """Return what a run saw an image with."""
    run = runs.get_run(session, run_id)
    camera, frame = camera_of(session, run.registration_id)
    settings = fusion_settings(run.preset, run.parameters)
    level_m = repository.water_level_m(session, run_id, image.id)
    if level_m is None:
        level_m = sites.get_site(session, run.site_id).water_level_m
    return Scene(
        run,
        image,
        camera,
        frame,
        level_m,
        # A person's choice is carried out, however improbable it is.
        replace(
            settings,
            matching=MatchingMethod.PAPER,
            maximum_cost=float("inf"),
            score_threshold=0.0,
        ),
    )


def detection_of_run(
    session: Session, run_id: int, detection_id: int
) -> tuple[DetectionRow, Image, Run]:
    """Return a detection with its image and run. Raises NotFound unless the run used it."""
    found = repository.detection_of_run(session, run_id, detection_id)
    if found is None:
        raise NotFound("there is no such detection in this run")
    return found


def candidates(
    session: Session, scene: Scene, row: DetectionRow
) -> tuple[list[Offered], list[Refused]]:
    """Return the vessels of an image by their cost against a detection, and those refused."""
    offered: list[Offered] = []
    refused: list[Refused] = []
    states = run_images.vessels(session, scene.run.id, scene.image.id)
    for index, (state, vessel, pose_id) in enumerate(states):
        placed = candidate_or_reason(
            index,
            vessel_state(state),
            scene.camera,
            scene.frame,
            scene.water_level_m,
            scene.settings,
        )
        if not isinstance(placed, Candidate):
            refused.append(Refused(state, vessel, placed))
        elif not placed.has_size:
            refused.append(Refused(state, vessel, UnmatchedReason.SIZE_UNKNOWN))
        else:
            cost = matching_cost(
                box_of(row), placed, scene.camera.intrinsics, scene.settings.border_tolerance_px
            )
            segment = scene.camera.project(placed.segment.corners_in_world)
            offered.append(Offered(state, vessel, pose_id, cost, segment, placed.rectangle_px))
    return sorted(offered, key=lambda one: one.cost.total), refused


def rematch(
    session: Session, scene: Scene, pose: Pose, newest: Correction | None, user_id: int, mmsi: int
) -> Correction:
    """Store a pose computed anew for another vessel as the next version of its correction.

    Raises Invalid naming `mmsi` when it was not heard at the image or cannot be placed.
    """
    state, fused = _fused(session, scene, pose.match.detection, mmsi)
    base = scene.frame.geodetic(fused.corners_in_world[:4].mean(axis=0))
    columns = pose_columns(scene.frame, vessel_state(state), fused)
    kept = {
        name: columns[name]
        for name in (
            "mmsi",
            "center_height_m",
            "heading_deg",
            "length_m",
            "width_m",
            "height_m",
            "centroid_in_cam_m",
            "rotvec_cam_from_vessel",
            "corners_in_image_px",
            "flags",
        )
    }
    correction = Correction(
        **kept,
        pose_id=pose.id,
        version=1 + (newest.version if newest else 0),
        kind=CorrectionKind.REMATCHED,
        user_id=user_id,
        vessel_state_id=state.id,
        lat_deg=base.lat_deg,
        lon_deg=base.lon_deg,
        base_height_m=base.height_m,
        cost=fused.cost,
        cost_terms=fused.cost_terms,
    )
    session.add(correction)
    session.flush()
    return correction


def make_pose(session: Session, scene: Scene, row: DetectionRow, mmsi: int) -> Pose:
    """Make a pose of a detection that has none and a vessel a person chose.

    Raises Conflict with `pose_id` where one of them has a pose already, Invalid naming `mmsi`.
    """
    other = repository.pose_in_the_way(
        session, scene.run.id, scene.image.id, detection_id=row.id, mmsi=mmsi
    )
    if other is not None:
        field = "mmsi" if other.mmsi == mmsi else "detection_id"
        message = f"has pose {other.id} already; match that pose anew instead"
        raise Conflict(
            f"{field}: {message}",
            fields=(FieldError(field, message),),
            more={"pose_id": other.id},
        )
    state, fused = _fused(session, scene, row, mmsi)
    match = Match(
        run_id=scene.run.id,
        detection_id=row.id,
        vessel_state_id=state.id,
        cost=fused.cost,
        cost_terms=fused.cost_terms,
    )
    session.add(match)
    session.flush()
    pose = Pose(
        **pose_columns(scene.frame, vessel_state(state), fused),
        run_id=scene.run.id,
        image_id=scene.image.id,
        match_id=match.id,
        person_made=True,
    )
    session.add(pose)
    session.flush()
    return pose


def _fused(
    session: Session, scene: Scene, row: DetectionRow, mmsi: int
) -> tuple[VesselStateRow, FusedPose]:
    state = repository.state_row(session, scene.run.id, scene.image.id, mmsi)
    if state is None:
        raise Invalid.field("mmsi", "was not heard around this image")
    result = fuse(
        scene.camera,
        scene.frame,
        scene.water_level_m,
        [box_of(row)],
        [vessel_state(state)],
        scene.settings,
    )
    if not result.poses:
        reason = UnmatchedReason(result.unmatched_states[0])
        raise Invalid.field("mmsi", f"cannot be what this box shows: {REASONS[reason]}")
    return state, result.poses[0]


def vessel_state(row: VesselStateRow) -> VesselState:
    """Return a stored vessel state as fusion takes it; one of an old run without its sigmas."""
    state = VesselState(
        identifier=str(row.mmsi),
        lat_deg=row.lat_deg,
        lon_deg=row.lon_deg,
        heading_deg=row.heading_deg,
        speed_kn=row.speed_kn,
        age_s=row.age_s,
        to_bow_m=row.to_bow_m,
        to_stern_m=row.to_stern_m,
        to_port_m=row.to_port_m,
        to_starboard_m=row.to_starboard_m,
        heading_source=HeadingSource(row.heading_source),
        report_ids=tuple(row.report_ids),
        static_ids=tuple(row.static_ids),
        track_method=TrackMethod(row.track_method) if row.track_method else None,
        flags=tuple(row.flags),
    )
    if row.position_covariance_m2 is None or row.heading_sigma_deg is None:
        return state
    east, east_north, north = row.position_covariance_m2
    return replace(
        state,
        position_covariance_m2=(east, east_north, north),
        heading_sigma_deg=row.heading_sigma_deg,
    )


def box_of(row: DetectionRow) -> Detection:
    """Return a stored detection as fusion takes it."""
    return Detection(row.x1_px, row.y1_px, row.x2_px, row.y2_px, row.score, row.class_id)


def segment_pixels(offered: Offered) -> Sequence[list[float] | None]:
    """Return an offered vessel's plane segment as lists."""
    return pixels(offered.segment_px)
