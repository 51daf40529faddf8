"""Whatever removes something can be undone for 30 days, or says here and to people why it is final.

What a route calls is followed, as for the audit log, until one of them deletes for a while.
"""

from pathlib import Path

from fastapi.routing import APIRoute

from app.auth.declared import routes_of
from app.config import Settings
from app.deletions import service
from app.main import create_app
from tests.architecture.calls import reaches

# How the paths of forms end that remove something; REST does it by DELETE.
REMOVING = ("/delete", "/remove", "/revoke", "/discard", "/withdraw", "/unlink", "/reject", "/end")
KEY = "a key that was given up must never open again; another is made in a moment"
ERASED = "address and name are erased, as people may demand; the page says so and offers blocking"
DRAFT = "a draft: nothing of it was imported, and the file can be sent again"
SWITCH = "a person's own mark, set and taken with the same key"
HISTORY = "nothing is removed: a newer row stands, and the older can be set again"
OTHER_UNDO = "hidden with an undo of its own, which does not end"
JUDGED = "put back with the same verdict, which the audit log keeps"
ANSWERED = "a proposal that is answered no; nothing that was in force goes"
FINAL = {
    "DELETE /api/v1/tokens/{token_id}": KEY,
    "POST /account/tokens/{token_id}/revoke": KEY,
    "POST /admin/tokens/{token_id}/revoke": KEY,
    "DELETE /api/v1/invitations/{invitation_id}": KEY,
    "POST /admin/invitations/withdraw": KEY,
    "DELETE /api/v1/users/{user_id}/sessions": KEY,
    "DELETE /api/v1/me/sessions/{session_id}": KEY,
    "POST /account/sessions/end": KEY,
    "DELETE /api/v1/users/{user_id}/identity": KEY,
    "POST /admin/users/{user_id}/unlink": KEY,
    "DELETE /api/v1/users/{user_id}": ERASED,
    "POST /admin/users/{user_id}/remove": ERASED,
    "POST /imports/{import_id:int}/discard": DRAFT,
    "DELETE /api/v1/imports/{import_id:int}": DRAFT,
    "POST /ais/uploads/{upload_id:int}/discard": DRAFT,
    "DELETE /api/v1/poses/{pose_id}/bookmark": SWITCH,
    "DELETE /api/v1/images/{image_id}/bookmark": SWITCH,
    "DELETE /api/v1/images/{image_id}/complete": SWITCH,
    "DELETE /api/v1/poses/{pose_id}/corrections": HISTORY,
    "DELETE /api/v1/decisions/{decision_name}": HISTORY,
    "DELETE /api/v1/ground-truth/boxes/{box_id:int}": OTHER_UNDO,
    "DELETE /api/v1/calibration-sets/{set_id}/poses/{pose_id}": JUDGED,
    "DELETE /api/v1/webhooks/{webhook_id:int}": KEY,
    "POST /webhooks/{webhook_id:int}/remove": KEY,
    "POST /pointings/{pointing_id:int}/reject": ANSWERED,
    "POST /api/v1/pointings/{pointing_id:int}/reject": ANSWERED,
}


def test_every_removal_can_be_undone_or_says_why_not(tmp_path: Path) -> None:
    """A new way to remove something fails here until it is undoable or gives a reason."""
    final = {
        f"{method} {route.path}"
        for route in routes_of(create_app(Settings(data_dir=tmp_path)))
        if isinstance(route.original_route, APIRoute)
        for method in route.methods or set()
        if method == "DELETE" or (method == "POST" and (route.path or "").endswith(REMOVING))
        if not reaches(route.original_route.endpoint, service.delete)
    }
    assert final == set(FINAL)
