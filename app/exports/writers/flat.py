"""A pose as one flat row, for tables: the same columns in CSV and Parquet."""

from app.exports.writers.records import PoseRecord, refuse_what_is_no_number

Cell = str | int | float | None
TEXT, WHOLE, NUMBER = "text", "whole", "number"
CORNER_COLUMNS = tuple(f"corner{n}_{axis}_px" for n in range(1, 9) for axis in "uv")
COLUMNS: dict[str, str] = {
    **dict.fromkeys(("pose_id", "run_id", "registration_id", "viewport_id", "camera_id"), WHOLE),
    "image_id": WHOLE,
    **dict.fromkeys(("file_name", "image_sha256", "captured_at", "vessel"), TEXT),
    **dict.fromkeys(("lat_deg", "lon_deg", "center_height_m", "heading_deg"), NUMBER),
    "heading_source": TEXT,
    **dict.fromkeys(("report_age_s", "length_m", "width_m", "height_m"), NUMBER),
    **dict.fromkeys(("x_cam_m", "y_cam_m", "z_cam_m"), NUMBER),
    **dict.fromkeys(("rotvec_x", "rotvec_y", "rotvec_z"), NUMBER),
    **dict.fromkeys(("box_x1_px", "box_y1_px", "box_x2_px", "box_y2_px"), NUMBER),
    **dict.fromkeys(("score", "cost"), NUMBER),
    **dict.fromkeys(("correction_east_m", "correction_north_m", "correction_up_m"), NUMBER),
    **dict.fromkeys(("sigma_east_m", "sigma_north_m", "sigma_up_m"), NUMBER),
    **dict.fromkeys(("heading_sigma_deg", "height_sigma_m"), NUMBER),
    **dict.fromkeys(("grade", "reasons", "flags", "source", "split"), TEXT),
    **dict.fromkeys(CORNER_COLUMNS, NUMBER),
}


def row(pose: PoseRecord) -> list[Cell]:
    """Return a pose's cells in the order of `COLUMNS`; None for what is not known."""
    refuse_what_is_no_number(pose)
    image, view, review = pose.image, pose.view, pose.review
    corners: list[Cell] = []
    for corner in pose.corners_in_image_px:
        corners += (None, None) if corner is None else corner
    return [
        *(pose.id, pose.run_id, view.registration_id, view.viewport_id, image.camera_id, image.id),
        *(image.file_name, image.sha256, image.captured_at, pose.vessel),
        *(pose.lat_deg, pose.lon_deg, pose.center_height_m, pose.heading_deg, pose.heading_source),
        *(pose.report_age_s, pose.length_m, pose.width_m, pose.height_m),
        *pose.centroid_in_cam_m,
        *pose.rotvec_cam_from_vessel,
        *pose.box_px,
        *(pose.score, pose.cost),
        *pose.correction_in_enu_m,
        *_sigmas(pose),
        *(pose.heading_sigma_deg, pose.height_sigma_m),
        None if review is None else review.grade,
        None if review is None else " ".join(review.reasons),
        " ".join(pose.flags),
        *(pose.source, pose.part),
        *corners,
    ]


def _sigmas(pose: PoseRecord) -> list[float | None]:
    covariance = pose.position_covariance_in_enu_m2
    if covariance is None:
        return [None, None, None]
    return [max(covariance[axis][axis], 0.0) ** 0.5 for axis in range(3)]
