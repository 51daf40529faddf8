"""REST of corrections and re-matching."""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.auth.versions import VERSIONED, check_if_match, etag, set_etag
from app.dependencies import SessionDep
from app.domain.upright_box import UprightBox
from app.errors import PreconditionFailed
from app.identities import service as identities
from app.ids import RowId
from app.paging import Page
from app.registration.service import camera_of
from app.reviews import corrections, rematching, service
from app.reviews.correction_schemas import (
    CandidateOut,
    CandidatesOut,
    CorrectionIn,
    DeletedOut,
    EditOut,
    GeodeticOut,
    LocalCameraOut,
    PersonPoseIn,
    RefusedOut,
    RematchIn,
    RunCameraOut,
    local_box_out,
)
from app.reviews.image_schemas import DetectionOut
from app.reviews.placing import PlacedPose
from app.reviews.pose_schemas import CorrectionOut, PoseOut, PoseVessel
from app.reviews.rematching import Scene
from app.runs import service as runs
from app.sites import service as sites
from app.tables.detection import Detection
from app.tables.reviews import Correction

router = APIRouter(route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]


@router.get("/runs/{run_id}/camera")
def get_run_camera(run_id: int, session: SessionDep, access: Reader) -> RunCameraOut:
    """Return the camera that a run's poses were made with."""
    run = runs.get_run(session, run_id)
    access.require(Scope.READ, run.site_id)
    camera, frame = camera_of(session, run.registration_id)
    return RunCameraOut.of(camera, frame, sites.get_site(session, run.site_id).water_level_m)


@router.get("/poses/{pose_id}/edit")
def get_edit(pose_id: int, session: SessionDep, access: Reader, response: Response) -> EditOut:
    """Return all that is needed to draw and edit a pose's box; the ETag is its version."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    here = corrections.placed(session, service.get_pose(session, pose_id).pose)
    history = corrections.all_of(session, pose_id)
    newest = history[0] if history else None
    version = newest.version if newest else 0
    shown = [_shown(session, here, correction) for correction in history]
    set_etag(response, version)
    return EditOut(
        pose_id=pose_id,
        version=version,
        reference=GeodeticOut.of(here.reference),
        camera=LocalCameraOut.of(here.camera_in_local),
        generated=local_box_out(here.generated),
        current=local_box_out(corrections.present_box(here, newest)),
        correction=shown[0] if newest is not None and newest.deleted_at is None else None,
        corrections=shown,
    )


@router.get("/poses/{pose_id}/corrections")
def list_corrections(pose_id: int, session: SessionDep, access: Reader) -> Page[CorrectionOut]:
    """List all corrections of a pose, deleted ones too, newest first."""
    site_id = service.site_of_pose(session, pose_id)
    access.require(Scope.READ, site_id)
    history = corrections.all_of(session, pose_id)
    told = identities.at_site(session, site_id)
    return Page(items=[CorrectionOut.of(correction, told) for correction in history])


@router.post("/poses/{pose_id}/corrections", status_code=201, dependencies=[VERSIONED])
def correct_pose(
    pose_id: int,
    body: CorrectionIn,
    request: Request,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> CorrectionOut:
    """Store a pose as a person would have it, beside the generated one.

    `If-Match` says which version was edited; it may be left out where there is none yet. A stale
    one is answered with what stands now and how it differs.
    """
    site_id = service.site_of_pose(session, pose_id)
    access.require(Scope.REVIEW, site_id)
    newest = corrections.lock(session, pose_id)
    here = corrections.placed(session, service.get_pose(session, pose_id).pose)
    up_m = body.up_m
    if up_m is None:
        up_m = corrections.present_box(here, newest).up_m
    size = (body.length_m, body.width_m, body.height_m)
    box = corrections.box_at(here, body.spot(), body.heading_deg, size, up_m)
    _check_version(session, request, here, newest, box)
    correction = corrections.correct(session, here, newest, access.user_id, box, body.comment)
    record(session, access, "correct", "pose", pose_id, site_id=site_id, version=correction.version)
    set_etag(response, correction.version)
    response.headers["Location"] = f"/api/v1/poses/{pose_id}/corrections"
    return _shown(session, here, correction, user=access.name or access.email)


@router.delete("/poses/{pose_id}/corrections", dependencies=[VERSIONED])
def delete_correction(
    pose_id: int, request: Request, session: SessionDep, access: Reviewer, response: Response
) -> DeletedOut:
    """Let the generated pose count again; what was corrected stays readable."""
    site_id = service.site_of_pose(session, pose_id)
    access.require(Scope.REVIEW, site_id)
    newest = corrections.lock(session, pose_id)
    if newest is not None:
        here = corrections.placed(session, service.get_pose(session, pose_id).pose)
        _check_version(session, request, here, newest, None)
    version = corrections.delete(session, newest)
    record(session, access, "uncorrect", "pose", pose_id, site_id=site_id, version=version)
    set_etag(response, version)
    return DeletedOut(pose_id=pose_id, version=version)


@router.get("/poses/{pose_id}/candidates")
def list_candidates(pose_id: int, session: SessionDep, access: Reader) -> CandidatesOut:
    """List the vessels that a pose's detection may show, by cost, and those it cannot."""
    access.require(Scope.READ, service.site_of_pose(session, pose_id))
    reviewed = service.get_pose(session, pose_id)
    pose, correction = reviewed.pose, reviewed.correction
    scene = rematching.scene_of(session, pose.run_id, pose.image)
    mmsi = correction.mmsi if correction else pose.mmsi
    return _candidates(session, scene, pose.match.detection, pose_id, mmsi)


@router.post("/poses/{pose_id}/rematch", status_code=201, dependencies=[VERSIONED])
def rematch_pose(
    pose_id: int,
    body: RematchIn,
    request: Request,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> CorrectionOut:
    """Compute a pose anew for the vessel that its detection really shows, as a correction."""
    site_id = service.site_of_pose(session, pose_id)
    access.require(Scope.REVIEW, site_id)
    newest = corrections.lock(session, pose_id)
    pose = service.get_pose(session, pose_id).pose
    here = corrections.placed(session, pose)
    _check_version(session, request, here, newest, None)
    scene = rematching.scene_of(session, pose.run_id, pose.image)
    mmsi = identities.mmsi_at(session, site_id, body.mmsi)
    correction = rematching.rematch(session, scene, pose, newest, access.user_id, mmsi)
    record(
        session,
        access,
        "rematch",
        "pose",
        pose_id,
        site_id=site_id,
        version=correction.version,
        mmsi=mmsi,
    )
    set_etag(response, correction.version)
    response.headers["Location"] = f"/api/v1/poses/{pose_id}/corrections"
    return _shown(session, here, correction, user=access.name or access.email)


@router.get("/detections/{detection_id}/candidates")
def list_detection_candidates(
    detection_id: int, run_id: RowId, session: SessionDep, access: Reader
) -> CandidatesOut:
    """List the vessels that a detection without a pose may show, by cost, and those it cannot."""
    row, image, run = rematching.detection_of_run(session, run_id, detection_id)
    access.require(Scope.READ, run.site_id)
    return _candidates(session, rematching.scene_of(session, run.id, image), row, None, None)


@router.post("/detections/{detection_id}/poses", status_code=201)
def make_pose(
    detection_id: int,
    body: PersonPoseIn,
    session: SessionDep,
    access: Reviewer,
    response: Response,
) -> PoseOut:
    """Make a pose of a detection that has none, for the vessel that a person sees it shows."""
    row, image, run = rematching.detection_of_run(session, body.run_id, detection_id)
    access.require(Scope.REVIEW, run.site_id)
    scene = rematching.scene_of(session, run.id, image)
    mmsi = identities.mmsi_at(session, run.site_id, body.mmsi)
    pose = rematching.make_pose(session, scene, row, mmsi)
    record(session, access, "make", "pose", pose.id, site_id=run.site_id, mmsi=mmsi)
    response.headers["Location"] = f"/api/v1/poses/{pose.id}"
    return PoseOut.of(service.get_pose(session, pose.id, access.user_id))


def _check_version(
    session: Session,
    request: Request,
    here: PlacedPose,
    newest: Correction | None,
    wanted: UprightBox | None,
) -> None:
    """Compare `If-Match` with the present version; say what changed when it is stale."""
    version = newest.version if newest else 0
    if newest is None and "if-match" not in request.headers:
        return
    try:
        check_if_match(request, version)
    except PreconditionFailed as error:
        present = corrections.present_box(here, newest)
        stands = newest if newest is not None and newest.deleted_at is None else None
        shown = _shown(session, here, stands).model_dump(mode="json") if stands else None
        changed = [] if wanted is None else corrections.differences(wanted, present)
        raise PreconditionFailed(
            error.detail,
            headers={"ETag": etag(version)},
            more={"version": version, "current": shown, "changed": changed},
        ) from error


def _shown(
    session: Session, here: PlacedPose, correction: Correction, user: str | None = None
) -> CorrectionOut:
    told = identities.at_site(session, here.pose.image.site_id)
    vessel = PoseVessel.of(correction.mmsi, service.vessel(session, correction.mmsi), told)
    box = local_box_out(corrections.local_box(here, correction))
    shown = CorrectionOut.of(correction, told, vessel=vessel, box=box)
    return shown.model_copy(update={"user": user}) if user else shown


def _candidates(
    session: Session, scene: Scene, row: Detection, pose_id: int | None, mmsi: int | None
) -> CandidatesOut:
    offered, refused = rematching.candidates(session, scene, row)
    told = identities.at_site(session, scene.run.site_id)
    return CandidatesOut(
        detection=DetectionOut.of(row, pose_id),
        candidates=[
            CandidateOut.of(one, told, pose_id=pose_id, current_mmsi=mmsi) for one in offered
        ],
        refused=[RefusedOut.of(one, told) for one in refused],
    )
