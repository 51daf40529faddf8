"""REST of bookmarks, comments and chosen keys."""

from typing import Annotated

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope, allowed
from app.auth.audit import record
from app.auth.idempotency import IdempotentRoute
from app.dependencies import PagingDep, SessionDep
from app.errors import Forbidden
from app.ids import RowId
from app.paging import Page
from app.reviews import notes, run_images, service
from app.reviews.note_schemas import BookmarkOut, CommentIn, CommentOut, Keys

router = APIRouter(route_class=IdempotentRoute)

Reader = Annotated[Access, allowed(Scope.READ)]
Reviewer = Annotated[Access, allowed(Scope.REVIEW)]
Person = Annotated[Access, allowed(None)]


@router.put("/poses/{pose_id}/bookmark", status_code=204)
def bookmark_pose(pose_id: int, session: SessionDep, access: Reader) -> None:
    """Bookmark a pose for oneself."""
    image_id, _ = _pose(session, access, Scope.READ, pose_id)
    notes.set_bookmark(session, access.user_id, image_id, pose_id, on=True)


@router.delete("/poses/{pose_id}/bookmark", status_code=204)
def unbookmark_pose(pose_id: int, session: SessionDep, access: Reader) -> None:
    """Remove one's bookmark from a pose."""
    image_id, _ = _pose(session, access, Scope.READ, pose_id)
    notes.set_bookmark(session, access.user_id, image_id, pose_id, on=False)


@router.put("/images/{image_id}/bookmark", status_code=204)
def bookmark_image(image_id: int, session: SessionDep, access: Reader) -> None:
    """Bookmark an image for oneself."""
    access.require(Scope.READ, run_images.site_of_image(session, image_id))
    notes.set_bookmark(session, access.user_id, image_id, None, on=True)


@router.delete("/images/{image_id}/bookmark", status_code=204)
def unbookmark_image(image_id: int, session: SessionDep, access: Reader) -> None:
    """Remove one's bookmark from an image."""
    access.require(Scope.READ, run_images.site_of_image(session, image_id))
    notes.set_bookmark(session, access.user_id, image_id, None, on=False)


@router.get("/bookmarks")
def list_bookmarks(
    session: SessionDep, access: Reader, paging: PagingDep, run_id: RowId | None = None
) -> Page[BookmarkOut]:
    """List one's own bookmarks; with a run, those at its poses."""
    found, cursor = notes.bookmarks(
        session, access.user_id, access.site_ids(Scope.READ), run_id, paging
    )
    return Page(items=[BookmarkOut.of(bookmark) for bookmark in found], next_cursor=cursor)


@router.get("/poses/{pose_id}/comments")
def list_pose_comments(
    pose_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[CommentOut]:
    """List the comments on a pose, oldest first."""
    image_id, _ = _pose(session, access, Scope.READ, pose_id)
    found, cursor = notes.comments(session, image_id, pose_id, paging)
    return Page(items=[CommentOut.of(one, access.user_id) for one in found], next_cursor=cursor)


@router.post("/poses/{pose_id}/comments", status_code=201)
def comment_on_pose(
    pose_id: int, body: CommentIn, session: SessionDep, access: Reviewer, response: Response
) -> CommentOut:
    """Say something at a pose, for others to read."""
    image_id, site_id = _pose(session, access, Scope.REVIEW, pose_id)
    return _added(session, access, response, site_id, image_id, pose_id, body.text)


@router.get("/images/{image_id}/comments")
def list_image_comments(
    image_id: int, session: SessionDep, access: Reader, paging: PagingDep
) -> Page[CommentOut]:
    """List the comments on an image and its poses, oldest first."""
    access.require(Scope.READ, run_images.site_of_image(session, image_id))
    found, cursor = notes.comments(session, image_id, None, paging)
    return Page(items=[CommentOut.of(one, access.user_id) for one in found], next_cursor=cursor)


@router.post("/images/{image_id}/comments", status_code=201)
def comment_on_image(
    image_id: int, body: CommentIn, session: SessionDep, access: Reviewer, response: Response
) -> CommentOut:
    """Say something at an image, for others to read."""
    site_id = run_images.site_of_image(session, image_id)
    access.require(Scope.REVIEW, site_id)
    return _added(session, access, response, site_id, image_id, None, body.text)


@router.delete("/comments/{comment_id}", status_code=204)
def delete_comment(comment_id: int, session: SessionDep, access: Reviewer) -> None:
    """Delete a comment of one's own, or any as an administrator; it can be restored for 30 days."""
    comment = notes.get_comment(session, comment_id)
    site_id = run_images.site_of_image(session, comment.image_id)
    access.require(Scope.REVIEW, site_id)
    if comment.user_id != access.user_id and not access.may(Scope.ADMIN, site_id):
        raise Forbidden("only its author or an administrator removes a comment")
    record(session, access, "delete", "comment", comment.id, site_id=site_id)
    notes.delete_comment(session, comment, site_id, access.user_id)


@router.get("/me/keys")
def get_keys(session: SessionDep, access: Person) -> Keys:
    """Return the keys one chose."""
    return Keys.model_validate({"bindings": notes.keys(session, access.user_id)})


@router.put("/me/keys")
def set_keys(body: Keys, session: SessionDep, access: Person) -> Keys:
    """Choose keys, in the place of those chosen before."""
    notes.set_keys(session, access.user_id, body.bindings)
    return body


def _pose(session: Session, access: Access, scope: Scope, pose_id: int) -> tuple[int, int]:
    """Return the image and site of a pose that the caller may deal with."""
    site_id = service.site_of_pose(session, pose_id)
    access.require(scope, site_id)
    return notes.image_of_pose(session, pose_id), site_id


def _added(
    session: Session,
    access: Access,
    response: Response,
    site_id: int,
    image_id: int,
    pose_id: int | None,
    text: str,
) -> CommentOut:
    comment = notes.add_comment(session, access.user_id, image_id, pose_id, text)
    record(session, access, "create", "comment", comment.id, site_id=site_id)
    place = f"images/{image_id}" if pose_id is None else f"poses/{pose_id}"
    response.headers["Location"] = f"/api/v1/{place}/comments"
    return CommentOut.of(comment, access.user_id, user=access.name or access.email)
