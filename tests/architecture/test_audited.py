"""Every route that changes something leaves a line in the audit log, or says here why it does not.

What a route calls is followed through the application's own functions, by the names they are called
by, until one of them is the audit log's `record`.
"""

from pathlib import Path

from fastapi.routing import APIRoute

from app.auth.audit import record
from app.auth.declared import routes_of
from app.config import Settings
from app.dependencies import SAFE_METHODS
from app.main import create_app
from tests.architecture.calls import reaches

SHOWN = "shows what would be; stores nothing that lasts"
BATCH = "a part of a batch on its way in; the batch itself leaves the line"
OPINION = "a row of its own with author and time, replaced and never changed"
LEASE = "a lease, which runs out by itself"
OWN = "a person's own mark, key or exercise"
WISH = "the job that makes the link leaves the line"
WITHOUT = {
    "POST /sign-in/forgotten": WISH,
    "POST /api/v1/viewports/{viewport_id:int}/solve": SHOWN,
    "POST /api/v1/ais/previews": SHOWN,
    "POST /ais": SHOWN,
    "POST /ais/uploads/{upload_id:int}/mapping": SHOWN,
    "POST /ais/uploads/{upload_id:int}/stop": SHOWN,
    "POST /ais/uploads/{upload_id:int}/discard": SHOWN,
    "POST /api/v1/imports/{import_id:int}/files": BATCH,
    "POST /api/v1/imports/{import_id:int}/pack": BATCH,
    "PUT /api/v1/imports/{import_id:int}/files/{import_file_id:int}": BATCH,
    "PUT /api/v1/imports/{import_id:int}/times-table": BATCH,
    "POST /imports/{import_id:int}/times-table": BATCH,
    "POST /api/v1/poses/{pose_id}/reviews": OPINION,
    "POST /api/v1/images/{image_id}/reviews": OPINION,
    "PATCH /api/v1/decisions/{decision_name}": OPINION,
    "POST /api/v1/images/{image_id}/missed-vessels": OPINION,
    "POST /api/v1/review-queues/{queue_id}/next": LEASE,
    "POST /api/v1/review-queues/{queue_id}/extend": LEASE,
    "POST /api/v1/review-queues/{queue_id}/release": LEASE,
    "POST /api/v1/ground-truth/files/preview": SHOWN,
    "POST /ground-truth/look": SHOWN,
    "PUT /api/v1/poses/{pose_id}/bookmark": OWN,
    "DELETE /api/v1/poses/{pose_id}/bookmark": OWN,
    "PUT /api/v1/images/{image_id}/bookmark": OWN,
    "DELETE /api/v1/images/{image_id}/bookmark": OWN,
    "PUT /api/v1/me/keys": OWN,
    "POST /api/v1/calibration-sets/{set_id}/grades": OWN,
    "POST /api/v1/calibration-sets/{set_id}/restart": OWN,
    "POST /calibration-sets/{set_id}/practice": OWN,
    "POST /calibration-sets/{set_id}/restart": OWN,
}


def test_every_writing_route_is_audited(tmp_path: Path) -> None:
    """A new route that writes without a trace fails here until it leaves one or gives a reason."""
    silent = {
        f"{method} {route.path}"
        for route in routes_of(create_app(Settings(data_dir=tmp_path)))
        if isinstance(route.original_route, APIRoute)
        for method in (route.methods or set()) - SAFE_METHODS
        if not reaches(route.original_route.endpoint, record)
    }
    assert silent <= set(WITHOUT)
