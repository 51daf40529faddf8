"""One of everything on a site, so that tests can ask who may reach it."""

from sqlalchemy.orm import Session

from app.db import now
from app.deletions import service as deletions
from app.domain.accounting import Accounting
from app.tables.ais import AisFile, AisPosition, Vessel
from app.tables.ais_uploads import AisUpload
from app.tables.calibration import (
    CalibrationPhoto,
    CalibrationSource,
    CalibrationStatus,
    CameraCalibration,
)
from app.tables.clock import ClockOffset, OffsetSource
from app.tables.detection import Detection, DetectionSet, Model, ModelStatus
from app.tables.exports import Export
from app.tables.feeds import AisFeed, FeedKind
from app.tables.groundtruth import (
    GroundTruthBox,
    GroundTruthFile,
    GroundTruthImage,
    VesselClass,
)
from app.tables.imagery import CaptureTimeSource, Image
from app.tables.imports import ImageImport, ImportFile
from app.tables.learning import LearntSettings
from app.tables.live import RetentionKind, RetentionRule, StandingRun, WatchedFolder
from app.tables.notes import Comment
from app.tables.practice import CalibrationSet, JudgedPose
from app.tables.queues import QueueOrder, QueueUnit, ReviewQueue
from app.tables.registration import Landmark, Registration, RegistrationMethod
from app.tables.reregistration import Pointing, Reregistration, ReregistrationImage
from app.tables.reviews import Grade, MissedReason, MissedVessel
from app.tables.runs import Match, Pose, Run, RunImage, VesselStateRow
from app.tables.sites import Camera, Site, Viewport
from app.tables.webhooks import DeliveryStatus, Webhook, WebhookDelivery, WebhookEvent
from app.webhooks.signing import new_secret

INTRINSICS = {
    "width_px": 640,
    "height_px": 480,
    "fx_px": 800.0,
    "fy_px": 800.0,
    "cx_px": 319.5,
    "cy_px": 239.5,
    "distortion": [0.0] * 5,
}


def make_world(session: Session, marker: str, mmsi: int) -> dict[str, int]:
    """Insert a site with one of everything, named after the marker; return ids by path name."""
    site = Site(name=f"{marker} harbour", origin_lat_deg=54.0, origin_lon_deg=9.0)
    session.add(site)
    session.flush()
    camera = Camera(site_id=site.id, name=f"{marker} camera", **INTRINSICS)
    session.add(camera)
    session.flush()
    viewport = Viewport(camera_id=camera.id, name=f"{marker} viewport")
    landmark = Landmark(
        site_id=site.id, name=f"{marker} landmark", lat_deg=54.0, lon_deg=9.0, height_m=3.0
    )
    session.add_all([viewport, landmark])
    session.flush()
    ids = {"site_id": site.id, "camera_id": camera.id, "viewport_id": viewport.id}
    ids |= {"landmark_id": landmark.id} | _ais(session, site, marker, mmsi)
    image = _image(session, camera, viewport, marker)
    run_ids = _run(session, site, viewport, image, marker, mmsi)
    turned = make_turned(session, viewport, image, run_ids["registration_id"], marker)
    turned |= _deleted(session, camera, marker) | _clock(session, camera)
    turned |= _learnt(session, site) | _live(session, camera, viewport, run_ids["model_id"])
    ids |= make_import(session, camera, marker) | _ground_truth(session, image)
    return ids | {"image_id": image.id} | run_ids | turned


def _ground_truth(session: Session, image: Image) -> dict[str, int]:
    file = GroundTruthFile(
        site_id=image.site_id,
        sha256=image.sha256,
        file_name="boxes.json",
        document={"categories": [{"id": 0, "name": "ship"}]},
        class_of_category={"0": "ship"},
    )
    session.add(file)
    session.flush()
    annotated = GroundTruthImage(
        site_id=image.site_id,
        image_id=image.id,
        file_id=file.id,
        file_name=image.file_name,
        base_name=image.file_name,
        width_px=image.width_px,
        height_px=image.height_px,
        content_sha256=image.sha256,
    )
    session.add(annotated)
    session.flush()
    box = GroundTruthBox(
        ground_truth_image_id=annotated.id,
        x1_px=1.0,
        y1_px=1.0,
        x2_px=2.0,
        y2_px=2.0,
        area_px2=1.0,
        vessel_class=VesselClass.SHIP,
    )
    session.add(box)
    session.flush()
    return {
        "ground_truth_file_id": file.id,
        "ground_truth_image_id": annotated.id,
        "box_id": box.id,
    }


def _clock(session: Session, camera: Camera) -> dict[str, int]:
    offset = ClockOffset(camera_id=camera.id, offset_s=1.5, source=OffsetSource.GIVEN)
    session.add(offset)
    session.flush()
    return {"offset_id": offset.id}


def _learnt(session: Session, site: Site) -> dict[str, int]:
    learnt = LearntSettings(
        site_id=site.id, number=1, settings={"detected_share": 0.7}, basis={"image_ids": []}
    )
    session.add(learnt)
    session.flush()
    return {"learnt_id": learnt.id}


def _live(session: Session, camera: Camera, viewport: Viewport, model_id: int) -> dict[str, int]:
    folder = WatchedFolder(camera_id=camera.id, path="/srv/photographs")
    standing = StandingRun(
        viewport_id=viewport.id,
        model_id=model_id,
        name=f"{viewport.name}, standing",
        preset="paper",
        parameters={},
        ais_wait_s=3600.0,
    )
    rule = RetentionRule(site_id=camera.site_id, kind=RetentionKind.IMAGES, keep_days=365)
    session.add_all([folder, standing, rule])
    session.flush()
    return {"folder_id": folder.id, "standing_id": standing.id, "rule_id": rule.id}


def _deleted(session: Session, camera: Camera, marker: str) -> dict[str, int]:
    viewport = Viewport(camera_id=camera.id, name=f"{marker} former viewport")
    session.add(viewport)
    session.flush()
    deletion = deletions.delete(
        session, "viewport", [viewport.id], site_id=camera.site_id, label=viewport.name
    )
    return {"deletion_id": deletion.id}


def _ais(session: Session, site: Site, marker: str, mmsi: int) -> dict[str, int]:
    file = AisFile(
        site_id=site.id,
        sha256=f"{mmsi:064d}",
        file_name=f"{marker}.csv",
        format="table",
        size_bytes=1,
        accounting={**Accounting().as_dict(), "vessels": 1},
    )
    session.add(file)
    session.flush()
    moment = now()
    session.add(
        AisPosition(
            site_id=site.id,
            file_id=file.id,
            mmsi=mmsi,
            fix_time=moment,
            received_at=moment,
            lat_deg=54.0,
            lon_deg=9.0,
        )
    )
    session.add(Vessel(mmsi=mmsi, name=f"{marker} ship", first_seen_at=moment, last_seen_at=moment))
    upload = AisUpload(
        site_id=site.id,
        sha256="0" * 64,
        file_name=f"{marker}.nmea",
        size_bytes=1,
        workflow_id=f"{marker} upload",
    )
    session.add(upload)
    session.flush()
    return (
        make_feed(session, site.id, marker)
        | make_webhook(session, site.id, marker)
        | {
            "upload_id": upload.id,
            "file_id": file.id,
            "mmsi": mmsi,
        }
    )


def make_webhook(session: Session, site_id: int, marker: str) -> dict[str, int]:
    """Insert a webhook with a delivery that was given up."""
    webhook = Webhook(
        site_id=site_id,
        url=f"https://{marker.lower()}.example/hook",
        events=["run.finished"],
        secret=new_secret(),
    )
    session.add(webhook)
    session.flush()
    delivery = WebhookDelivery(
        webhook_id=webhook.id,
        event=WebhookEvent.TEST,
        content={"type": "test"},
        status=DeliveryStatus.FAILED,
    )
    session.add(delivery)
    session.flush()
    return {"webhook_id": webhook.id, "delivery_id": delivery.id}


def make_feed(session: Session, site_id: int, marker: str) -> dict[str, int]:
    """Insert a live feed that is switched off."""
    feed = AisFeed(
        site_id=site_id,
        name=f"{marker} feed",
        kind=FeedKind.TCP,
        host=f"{marker}.example",
        port=5631,
        silent_after_s=60.0,
        enabled=False,
    )
    session.add(feed)
    session.flush()
    return {"feed_id": feed.id}


def _image(session: Session, camera: Camera, viewport: Viewport, marker: str) -> Image:
    image = Image(
        site_id=camera.site_id,
        camera_id=camera.id,
        viewport_id=viewport.id,
        sha256=f"{camera.id:064d}",
        media_type="image/jpeg",
        file_name=f"{marker}.jpg",
        size_bytes=1,
        width_px=640,
        height_px=480,
        captured_at=now(),
        captured_at_source=CaptureTimeSource.GIVEN,
    )
    session.add(image)
    session.flush()
    return image


def make_import(session: Session, camera: Camera, marker: str) -> dict[str, int]:
    """Insert a batch of images on its way in, with one file."""
    batch = ImageImport(
        site_id=camera.site_id, camera_id=camera.id, name=f"{marker} card", times={}
    )
    session.add(batch)
    session.flush()
    file = ImportFile(
        import_id=batch.id, path=f"{marker}.jpg", path_key=f"{batch.id:064d}", size_bytes=1
    )
    session.add(file)
    session.flush()
    return {"import_id": batch.id, "import_file_id": file.id}


def make_turned(
    session: Session, viewport: Viewport, image: Image, registration_id: int, marker: str
) -> dict[str, int]:
    """Insert a re-registration that found one pointing, and a calibration with one photograph."""
    row = Reregistration(
        site_id=image.site_id,
        viewport_id=viewport.id,
        registration_id=registration_id,
        reference_image_id=image.id,
        settings={"images": "all", "gate": {"inliers": 15, "hull_share": 0.03, "angle_deg": 15}},
        workflow_id=f"reregister-of-{marker}",
        image_count=1,
    )
    session.add(row)
    session.flush()
    pointing = Pointing(
        reregistration_id=row.id,
        position=0,
        rotation_from_reference=[0.0, 0.01, 0.0],
        angle_deg=0.57,
        covariance=[[1e-8, 0.0, 0.0], [0.0, 1e-8, 0.0], [0.0, 0.0, 1e-7]],
        first_at=image.captured_at,
        last_at=image.captured_at,
        image_count=1,
    )
    session.add(pointing)
    session.flush()
    session.add(
        ReregistrationImage(
            reregistration_id=row.id,
            image_id=image.id,
            position=0,
            pointing_id=pointing.id,
            rotation_from_reference=pointing.rotation_from_reference,
            covariance=pointing.covariance,
            angle_deg=pointing.angle_deg,
            inliers=80,
            hull_share=0.4,
            rmse_px=1.5,
            keyframe_ids=[image.id],
            attempts=1,
            done_at=now(),
        )
    )
    session.flush()
    calibration = CameraCalibration(
        camera_id=image.camera_id,
        number=1,
        source=CalibrationSource.CHEQUERBOARD,
        status=CalibrationStatus.SOLVED,
        corner_columns=9,
        corner_rows=6,
        square_mm=30.0,
        intrinsics=INTRINSICS,
        rms_px=0.2,
        coverage=0.6,
    )
    session.add(calibration)
    session.flush()
    photo = CalibrationPhoto(
        calibration_id=calibration.id,
        position=1,
        file_name=f"{marker} board.jpg",
        sha256=image.sha256,
        media_type="image/jpeg",
        corners=[[float(at), float(at)] for at in range(54)],
        rms_px=0.2,
        tilt_deg=20.0,
    )
    session.add(photo)
    session.flush()
    return {
        "reregistration_id": row.id,
        "pointing_id": pointing.id,
        "calibration_id": calibration.id,
        "photo_number": photo.position,
    }


def _run(
    session: Session, site: Site, viewport: Viewport, image: Image, marker: str, mmsi: int
) -> dict[str, int]:
    model = Model(
        name=f"Model {site.id}",
        family="imported",
        sha256=f"{site.id:064d}",
        size_bytes=0,
        status=ModelStatus.READY,
        signature={"boxes": 1},
    )
    registration = Registration(
        viewport_id=viewport.id,
        method=RegistrationMethod.GIVEN,
        rotation=[0.0, 0.0, 0.0],
        center_lat_deg=54.0,
        center_lon_deg=9.0,
        center_height_m=20.0,
        intrinsics=INTRINSICS,
    )
    found = DetectionSet(
        image_sha256=image.sha256, model_sha256=model.sha256, settings_sha256="0" * 64
    )
    session.add_all([model, registration, found])
    session.flush()
    detection = Detection(
        detection_set_id=found.id,
        x1_px=1.0,
        y1_px=1.0,
        x2_px=2.0,
        y2_px=2.0,
        score=1.0,
        class_id=8,
    )
    run = Run(
        site_id=site.id,
        viewport_id=viewport.id,
        registration_id=registration.id,
        model_id=model.id,
        name=f"{marker} run",
        preset="paper",
        parameters={},
        code_version="1",
        workflow_id=f"run-of-{marker}",
        image_count=1,
    )
    export = Export(
        format="coco",
        filters={},
        site_ids=[site.id],
        anonymise=True,
        workflow_id=f"export-of-{marker}",
    )
    session.add_all([detection, run, export])
    session.flush()
    pose = _pose(session, run, image, detection, mmsi)
    return _reviewing(session, run, image, pose, marker) | {
        "model_id": model.id,
        "registration_id": registration.id,
        "run_id": run.id,
        "export_id": export.id,
        "pose_id": pose.id,
        "detection_id": detection.id,
    }


def _reviewing(session: Session, run: Run, image: Image, pose: Pose, marker: str) -> dict[str, int]:
    queue = ReviewQueue(run_id=run.id, unit=QueueUnit.POSE, order=QueueOrder.TIME, double=False)
    missed = MissedVessel(
        image_id=image.id,
        run_id=run.id,
        x1_px=1.0,
        y1_px=1.0,
        x2_px=2.0,
        y2_px=2.0,
        reason=MissedReason.NO_AIS,
        comment=f"{marker} barge",
    )
    comment = Comment(image_id=image.id, pose_id=pose.id, text=f"{marker} comment")
    judged = CalibrationSet(
        run_id=run.id, name=f"{marker} set", from_truth=False, guideline_version=1
    )
    session.add_all([queue, missed, comment, judged])
    session.flush()
    session.add(
        JudgedPose(
            set_id=judged.id,
            pose_id=pose.id,
            position=0,
            grade=Grade.OK,
            reasons=["heading"],
            note=f"{marker} note",
        )
    )
    # A decision is known by the name its maker gave it: to others any name is unknown.
    return {
        "queue_id": queue.id,
        "set_id": judged.id,
        "missed_id": missed.id,
        "comment_id": comment.id,
        "decision_name": 1,
        "job_id": 1,
    }


def _pose(session: Session, run: Run, image: Image, detection: Detection, mmsi: int) -> Pose:
    state = VesselStateRow(
        run_id=run.id,
        image_id=image.id,
        mmsi=mmsi,
        lat_deg=54.0,
        lon_deg=9.0,
        heading_deg=0.0,
        heading_source="reported",
        speed_kn=0.0,
        age_s=0.0,
        to_bow_m=10.0,
        to_stern_m=10.0,
        to_port_m=2.0,
        to_starboard_m=2.0,
        report_ids=[],
        outcome="matched",
        segments_px={"reported": [], "dead_reckoned": []},
    )
    session.add_all([state, RunImage(run_id=run.id, image_id=image.id, position=0)])
    session.flush()
    match = Match(
        run_id=run.id,
        detection_id=detection.id,
        vessel_state_id=state.id,
        cost=1.0,
        cost_terms={},
    )
    session.add(match)
    session.flush()
    pose = Pose(
        run_id=run.id,
        image_id=image.id,
        match_id=match.id,
        mmsi=mmsi,
        lat_deg=54.0,
        lon_deg=9.0,
        center_height_m=2.0,
        heading_deg=0.0,
        centroid_in_cam_m=[0.0, 0.0, 100.0],
        rotvec_cam_from_vessel=[0.0, 0.0, 0.0],
        length_m=20.0,
        width_m=4.0,
        height_m=4.0,
        corners_in_image_px=[[0.0, 0.0]] * 8,
        corrected_segment_px=[[0.0, 0.0]] * 4,
        correction_in_enu_m=[0.0, 0.0, 0.0],
        flags=[],
    )
    session.add(pose)
    session.flush()
    return pose
