"""Shapes of reviews in REST: what people say of poses."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.ids import LARGEST_WIDE_ID, RowId
from app.reviews.service import ReviewedPose
from app.tables.reviews import Grade, Review

Reasons = Annotated[list[Annotated[str, Field(max_length=32)]], Field(max_length=10)]
CommentText = Annotated[str, Field(max_length=4000, pattern=r"^[^\x00]*$")]
Decision = Annotated[
    str,
    Field(min_length=1, max_length=200, pattern=r"^[^\x00/]+$", description="The client's name"),
]
Seconds = Annotated[float, Field(ge=0, le=86400, allow_inf_nan=False, description="Time it took")]
WideId = Annotated[int, Field(ge=1, le=LARGEST_WIDE_ID)]


class ReviewIn(BaseModel):
    """A person's verdict on a pose."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"grade": "ok", "reasons": ["heading"], "comment": None, "seconds": 1.8},
            ]
        },
    )

    grade: Grade
    reasons: Reasons = []
    comment: CommentText | None = None
    seconds: Seconds | None = None
    decision: Decision | None = None
    settle: Annotated[
        bool, Field(description="End a disagreement: this verdict counts from now on")
    ] = False


class RestIn(BaseModel):
    """One verdict on what is left of an image."""

    model_config = ConfigDict(extra="forbid")

    run_id: RowId
    grade: Literal[Grade.GOOD] = Grade.GOOD
    pose_ids: Annotated[
        list[WideId] | None,
        Field(max_length=500, description="Left out: all that nobody has graded"),
    ] = None
    decision: Decision | None = None
    seconds: Seconds | None = None


class WordsIn(BaseModel):
    """Reasons or a comment for a decision made before; what is left out stays."""

    model_config = ConfigDict(extra="forbid")

    reasons: Reasons | None = None
    comment: CommentText | None = None


class ReviewOut(BaseModel):
    """A verdict as it was stored."""

    id: int
    pose_id: int
    grade: Grade
    reasons: list[str]
    comment: str | None
    seconds: float | None
    guideline_version: int
    inherited: bool
    user: str | None
    user_id: int | None
    decision: str | None
    second_opinion: bool
    settles: bool
    created_at: datetime
    replaced_at: datetime | None
    withdrawn_at: datetime | None

    @classmethod
    def of(cls, review: Review, user: str | None = None) -> "ReviewOut":
        """Take the columns of a review."""
        return cls(
            id=review.id,
            pose_id=review.pose_id,
            grade=review.grade,
            reasons=review.reasons,
            comment=review.comment,
            seconds=review.seconds,
            guideline_version=review.guideline_version,
            inherited=review.inherited_from_id is not None,
            user=user or (review.user.name or review.user.email if review.user else None),
            user_id=review.user_id,
            decision=review.decision,
            second_opinion=review.second_opinion,
            settles=review.settles,
            created_at=review.created_at,
            replaced_at=review.replaced_at,
            withdrawn_at=review.withdrawn_at,
        )


class DecisionOut(BaseModel):
    """What was said in one stroke; `skipped` are the poses that were judged already."""

    decision: str
    reviews: list[ReviewOut]
    skipped: list[int] = []


class PoseVerdicts(BaseModel):
    """What stands for a pose after something was taken back: the caller's own, and in all."""

    pose_id: int
    mine: ReviewOut | None
    review: ReviewOut | None

    @classmethod
    def of(cls, reviewed: ReviewedPose) -> "PoseVerdicts":
        """Take what stands for a pose."""
        mine, review = reviewed.mine, reviewed.review
        return cls(
            pose_id=reviewed.pose.id,
            mine=ReviewOut.of(mine) if mine else None,
            review=ReviewOut.of(review) if review else None,
        )


class WithdrawnOut(BaseModel):
    """A decision that was taken back, and what stands now."""

    decision: str
    poses: list[PoseVerdicts]
