"""Bookmarks, which are a person's own, and comments, which everybody on the site reads."""

from collections.abc import Mapping, Sequence

from sqlalchemy.orm import Session

from app.deletions import service as deletions
from app.errors import Conflict, NotFound
from app.paging import Paging
from app.reviews import note_repository as repository
from app.tables.notes import Bookmark, Comment

MOST_COMMENTS = 500
_LABEL = 100  # characters of a comment that name it when it is deleted


def image_of_pose(session: Session, pose_id: int) -> int:
    """Return the image of a pose. Raises NotFound."""
    image_id = repository.image_of_pose(session, pose_id)
    if image_id is None:
        raise NotFound("there is no such pose")
    return image_id


def set_bookmark(
    session: Session, user_id: int, image_id: int, pose_id: int | None, *, on: bool
) -> None:
    """Set or remove a person's bookmark at a pose, or at an image for None."""
    change = repository.add_bookmark if on else repository.drop_bookmark
    change(session, user_id, image_id, pose_id)


def bookmarks(
    session: Session,
    user_id: int,
    site_ids: frozenset[int] | None,
    run_id: int | None,
    paging: Paging,
) -> tuple[Sequence[Bookmark], str | None]:
    """Return a page of a person's bookmarks on some sites (None: all)."""
    return repository.bookmarks(session, user_id, site_ids, run_id, paging)


def comments(
    session: Session, image_id: int, pose_id: int | None, paging: Paging
) -> tuple[Sequence[Comment], str | None]:
    """Return a page of the comments on an image and its poses, or on one pose, oldest first."""
    return repository.comments(session, image_id, pose_id, paging)


def add_comment(
    session: Session, user_id: int, image_id: int, pose_id: int | None, text: str
) -> Comment:
    """Store a comment. Raises Conflict where there are very many already."""
    if repository.count_comments(session, image_id) >= MOST_COMMENTS:
        raise Conflict(
            f"this image has {MOST_COMMENTS} comments already; remove some that are settled"
        )
    comment = Comment(user_id=user_id, image_id=image_id, pose_id=pose_id, text=text)
    session.add(comment)
    session.flush()
    return comment


def get_comment(session: Session, comment_id: int) -> Comment:
    """Return a comment. Raises NotFound."""
    comment = repository.comment(session, comment_id)
    if comment is None:
        raise NotFound("there is no such comment")
    return comment


def delete_comment(session: Session, comment: Comment, site_id: int, user_id: int) -> None:
    """Delete a comment for 30 days."""
    label = comment.text if len(comment.text) <= _LABEL else f"{comment.text[: _LABEL - 1]}…"
    deletions.delete(
        session, "comment", [comment.id], site_id=site_id, label=label, user_id=user_id
    )


def keys(session: Session, user_id: int) -> Mapping[str, Sequence[str]]:
    """Return the keys a person chose: command name to physical keys."""
    return repository.keys(session, user_id)


def set_keys(session: Session, user_id: int, bindings: Mapping[str, Sequence[str]]) -> None:
    """Store the keys a person chose."""
    repository.set_keys(session, user_id, bindings)
