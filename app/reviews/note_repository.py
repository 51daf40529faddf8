"""SQL of bookmarks, comments and chosen keys."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from app.db import find
from app.paging import Paging, fetch_page
from app.tables.imagery import Image
from app.tables.notes import Bookmark, Comment, KeyBindings
from app.tables.runs import Pose


def _insert(
    session: Session, table: type[Bookmark] | type[KeyBindings]
) -> sqlite.Insert | postgresql.Insert:
    """Return an insert that can meet what is there; both databases have one of their own."""
    if session.get_bind().dialect.name == "sqlite":
        return sqlite.insert(table)
    return postgresql.insert(table)


def add_bookmark(session: Session, user_id: int, image_id: int, pose_id: int | None) -> None:
    """Store a person's bookmark, once."""
    session.execute(
        _insert(session, Bookmark)
        .values(user_id=user_id, image_id=image_id, pose_id=pose_id)
        .on_conflict_do_nothing()
    )


def drop_bookmark(session: Session, user_id: int, image_id: int, pose_id: int | None) -> None:
    """Remove a person's bookmark, if there is one."""
    session.execute(
        sa.delete(Bookmark).where(
            Bookmark.user_id == user_id,
            Bookmark.image_id == image_id,
            Bookmark.pose_id.is_(None) if pose_id is None else Bookmark.pose_id == pose_id,
        )
    )


def bookmarks(
    session: Session,
    user_id: int,
    site_ids: Iterable[int] | None,
    run_id: int | None,
    paging: Paging,
) -> tuple[Sequence[Bookmark], str | None]:
    """Return a page of a person's bookmarks on some sites (None: all), in one run or in all."""
    statement = (
        sa.select(Bookmark)
        .join(Image, Image.id == Bookmark.image_id)
        .where(Bookmark.user_id == user_id, Image.deleted_at.is_(None))
    )
    if site_ids is not None:
        statement = statement.where(Image.site_id.in_(site_ids))
    if run_id is not None:
        in_run = sa.exists().where(Pose.id == Bookmark.pose_id, Pose.run_id == run_id)
        statement = statement.where(in_run)
    return fetch_page(session, statement, Bookmark.id, paging)


def image_of_pose(session: Session, pose_id: int) -> int | None:
    """Return the image of a pose."""
    return session.scalar(sa.select(Pose.image_id).where(Pose.id == pose_id))


def comments(
    session: Session, image_id: int, pose_id: int | None, paging: Paging
) -> tuple[Sequence[Comment], str | None]:
    """Return a page of the comments on an image, or on one pose in it, oldest first."""
    statement = sa.select(Comment).where(Comment.image_id == image_id)
    if pose_id is not None:
        statement = statement.where(Comment.pose_id == pose_id)
    return fetch_page(session, statement, Comment.id, paging)


def count_comments(session: Session, image_id: int) -> int:
    """Count the comments on an image and its poses."""
    return (
        session.scalar(
            sa.select(sa.func.count()).select_from(Comment).where(Comment.image_id == image_id)
        )
        or 0
    )


def comment(session: Session, comment_id: int) -> Comment | None:
    """Return a comment."""
    return find(session, Comment, comment_id)


def keys(session: Session, user_id: int) -> Mapping[str, Any]:
    """Return the keys a person chose."""
    found = session.get(KeyBindings, user_id)
    return {} if found is None else found.bindings


def set_keys(session: Session, user_id: int, bindings: Mapping[str, Sequence[str]]) -> None:
    """Store the keys a person chose in the place of those before."""
    values = {"bindings": {name: list(codes) for name, codes in bindings.items()}}
    session.execute(
        _insert(session, KeyBindings)
        .values(user_id=user_id, **values)
        .on_conflict_do_update(index_elements=["user_id"], set_=values)
    )
