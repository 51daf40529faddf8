"""Shapes of bookmarks, comments and chosen keys."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from app.tables.notes import Bookmark, Comment

CommandName = Annotated[str, Field(pattern=r"^[a-z0-9.-]{1,64}$")]
KeyCode = Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,32}$", description="`event.code`")]


class BookmarkOut(BaseModel):
    """A bookmark of the caller."""

    id: int
    image_id: int
    pose_id: int | None
    created_at: datetime

    @classmethod
    def of(cls, bookmark: Bookmark) -> "BookmarkOut":
        """Take the columns."""
        return cls(
            id=bookmark.id,
            image_id=bookmark.image_id,
            pose_id=bookmark.pose_id,
            created_at=bookmark.created_at,
        )


class CommentIn(BaseModel):
    """What somebody has to say."""

    model_config = ConfigDict(extra="forbid")

    text: Annotated[
        str,
        StringConstraints(strip_whitespace=True, min_length=1, max_length=4000),
        Field(pattern=r"^[^\x00]*$"),
    ]


class CommentOut(BaseModel):
    """What somebody said, at an image or at a pose in it."""

    id: int
    image_id: int
    pose_id: int | None
    user: str | None
    user_id: int | None
    mine: bool
    text: str
    created_at: datetime

    @classmethod
    def of(cls, comment: Comment, reader_id: int, user: str | None = None) -> "CommentOut":
        """Take the columns."""
        return cls(
            id=comment.id,
            image_id=comment.image_id,
            pose_id=comment.pose_id,
            user=user or (comment.user.name or comment.user.email if comment.user else None),
            user_id=comment.user_id,
            mine=comment.user_id == reader_id,
            text=comment.text,
            created_at=comment.created_at,
        )


class Keys(BaseModel):
    """The keys that a person chose: command name to physical keys; others keep their default."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"bindings": {"review.good": ["Digit1", "Numpad1"]}}]},
    )

    bindings: Annotated[
        dict[CommandName, Annotated[list[KeyCode], Field(max_length=5)]], Field(max_length=200)
    ]
