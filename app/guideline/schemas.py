"""Shapes of calibration sets in REST."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.guideline.practice import MOST_POSES, Compared, Judged, Result
from app.ids import LARGEST_WIDE_ID, RowId
from app.reviews.pose_schemas import PoseOut
from app.reviews.schemas import ReviewOut
from app.reviews.service import ReviewedPose
from app.tables.practice import CalibrationSet, PracticeGrade
from app.tables.reviews import Grade

PoseId = Annotated[int, Field(ge=1, le=LARGEST_WIDE_ID)]
Reasons = Annotated[list[Annotated[str, Field(max_length=32)]], Field(max_length=10)]
Note = Annotated[str, Field(max_length=2000, pattern=r"^[^\x00]*$")]
Name = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00]*$")]
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]


class JudgementIn(BaseModel):
    """The grade a pose deserves, and why."""

    model_config = ConfigDict(extra="forbid")

    grade: Grade
    reasons: Reasons = []
    note: Note = ""


class JudgedPoseIn(JudgementIn):
    """A judged pose."""

    pose_id: PoseId

    def judged(self) -> Judged:
        """Return it as the service takes it."""
        return Judged(self.pose_id, self.grade, self.reasons, self.note)


class CalibrationSetIn(BaseModel):
    """A new set: poses with grades, or a draw judged by a simulator's truth or by oneself."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"run_id": 1, "name": "For newcomers", "from_truth": True, "size": 20, "seed": 1}
            ]
        },
    )

    run_id: RowId
    name: Name
    poses: Annotated[list[JudgedPoseIn], Field(max_length=MOST_POSES)] = []
    from_truth: bool = False
    from_own_reviews: bool = False
    size: Annotated[int, Field(ge=1, le=MOST_POSES)] = 20
    seed: Seed = 1

    @model_validator(mode="after")
    def _one_way(self) -> "CalibrationSetIn":
        if [self.from_truth, self.from_own_reviews, bool(self.poses)].count(True) != 1:
            raise ValueError(
                "give one of `poses` with their grades, `from_truth`: true, "
                "`from_own_reviews`: true"
            )
        return self


class OwnPractice(BaseModel):
    """How the caller's latest attempt stands."""

    attempt: int
    answered: int
    agreed: int


class CalibrationSetOut(BaseModel):
    """A calibration set."""

    id: int
    run_id: int
    site_id: int
    name: str
    from_truth: bool
    seed: int | None
    poses: int
    guideline_version: int
    created_at: datetime
    mine: OwnPractice | None

    @classmethod
    def of(cls, found: CalibrationSet, poses: int, own: Result | None) -> "CalibrationSetOut":
        """Take the columns of a set."""
        mine = None
        if own is not None and own.answered:
            mine = OwnPractice(attempt=own.attempt, answered=own.answered, agreed=own.kappa.agreed)
        return cls(
            id=found.id,
            run_id=found.run_id,
            site_id=found.run.site_id,
            name=found.name,
            from_truth=found.from_truth,
            seed=found.seed,
            poses=poses,
            guideline_version=found.guideline_version,
            created_at=found.created_at,
            mine=mine,
        )


class PracticeIn(BaseModel):
    """A newcomer's grade of a judged pose."""

    model_config = ConfigDict(extra="forbid")

    pose_id: PoseId
    grade: Grade
    reasons: Reasons = []
    seconds: Annotated[float | None, Field(ge=0, le=86400, allow_inf_nan=False)] = None


class AnswerOut(BaseModel):
    """An answer beside the judgement."""

    pose_id: int
    grade: Grade
    reasons: list[str]
    judged_grade: Grade
    judged_reasons: list[str]
    note: str
    agrees: bool

    @classmethod
    def of(cls, compared: Compared, answer: PracticeGrade) -> "AnswerOut":
        """Put an answer beside its judgement."""
        return cls(
            pose_id=compared.judged.pose_id,
            grade=answer.grade,
            reasons=answer.reasons,
            judged_grade=compared.judged.grade,
            judged_reasons=compared.judged.reasons,
            note=compared.judged.note,
            agrees=compared.agrees,
        )


class PracticeOut(AnswerOut):
    """An answer with how far the attempt is."""

    answered: int
    total: int


class ResultOut(BaseModel):
    """How an attempt went: agreement with the judgements, and where they differed."""

    attempt: int
    answered: int
    total: int
    agreed: int
    percent: float | None
    kappa: float | None
    kappa_interval: tuple[float, float] | None
    differences: list[AnswerOut]
    answers: list[AnswerOut]

    @classmethod
    def of(cls, result: Result) -> "ResultOut":
        """Write a result out; of poses not answered yet nothing is told."""
        answers = [AnswerOut.of(pose, pose.answer) for pose in result.poses if pose.answer]
        return cls(
            attempt=result.attempt,
            answered=result.answered,
            total=len(result.poses),
            agreed=result.kappa.agreed,
            percent=result.percent,
            kappa=result.kappa.kappa,
            kappa_interval=result.kappa.interval,
            differences=[answer for answer in answers if not answer.agrees],
            answers=answers,
        )


def practice_pose(reviewed: ReviewedPose, own: PracticeGrade | None, version: int) -> PoseOut:
    """Show a pose without anybody's verdict, comment or correction; only one's own answer."""
    answer = None
    if own is not None:
        answer = ReviewOut(
            id=own.id,
            pose_id=own.pose_id,
            grade=own.grade,
            reasons=own.reasons,
            comment=None,
            seconds=own.seconds,
            guideline_version=version,
            inherited=False,
            user=None,
            user_id=None,
            decision=None,
            second_opinion=False,
            settles=False,
            created_at=own.created_at,
            replaced_at=None,
            withdrawn_at=None,
        )
    return PoseOut.of(reviewed).model_copy(
        update={
            "review": answer,
            "mine": answer,
            "opinions": 0,
            "disagreement": False,
            "comments": 0,
            "correction": None,
            "correction_version": 0,
        }
    )
