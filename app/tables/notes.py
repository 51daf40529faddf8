"""What people leave at poses and images besides verdicts: bookmarks, comments; and their keys."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column, relationship

from app.db import Base, now
from app.tables.deletion import DeletableAlone, index_of_deleted
from app.tables.identity import User


class Bookmark(Base):
    """A person's own mark at an image, or at one pose in it."""

    __tablename__ = "bookmarks"

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(sa.ForeignKey("users.id", ondelete="CASCADE"))
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    pose_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True
    )
    created_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (
        sa.Index(
            "uq_bookmarks_place",
            "user_id",
            "image_id",
            sa.text("coalesce(pose_id, 0)"),
            unique=True,
        ),
    )


class Comment(DeletableAlone, Base):
    """What a person said at an image, or at one pose in it, for others to read."""

    __tablename__ = "comments"

    id: Mapped[int] = mapped_column(primary_key=True)
    image_id: Mapped[int] = mapped_column(
        sa.ForeignKey("images.id", ondelete="CASCADE"), index=True
    )
    pose_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("poses.id", ondelete="CASCADE"), index=True
    )
    user_id: Mapped[int | None] = mapped_column(sa.ForeignKey("users.id", ondelete="SET NULL"))
    text: Mapped[str] = mapped_column(sa.Text)
    created_at: Mapped[datetime] = mapped_column(default=now)

    user: Mapped[User | None] = relationship(lazy="joined")

    __table_args__ = (index_of_deleted("comments"),)


class KeyBindings(Base):
    """The keys a person chose: command name to physical keys (`event.code`)."""

    __tablename__ = "key_bindings"

    user_id: Mapped[int] = mapped_column(
        sa.ForeignKey("users.id", ondelete="CASCADE"), primary_key=True
    )
    bindings: Mapped[dict[str, Any]]
