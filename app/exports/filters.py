"""What an export may select by: allow-listed fields, never relations of a caller's choosing.

The names are those of the lists and of the evaluation, so that a selection that was found there can
be exported as it stands: in a URL, in a JSON body, as options of the command.
"""

from datetime import UTC, datetime
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from app.ids import RowId, VesselRef

GradeName = Literal["good", "ok", "bad", "wrong", "ungraded"]
State = Literal["ungraded", "graded", "disagreement", "second_opinion", "settled"]
Verdict = Literal["standing", "newest", "consensus"]
UNGRADED = "ungraded"
FARTHEST_M = 1e6


def _in_utc(moment: datetime) -> datetime:
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


Moment = Annotated[datetime, AfterValidator(_in_utc)]
Metres = Annotated[float, Field(ge=0, le=FARTHEST_M, allow_inf_nan=False)]
# In a URL one grade is as good as a list of one.
Grades = Annotated[
    list[GradeName],
    BeforeValidator(lambda given: [given] if isinstance(given, str) else given),
    Field(max_length=5),
]


class ExportFilters(BaseModel):
    """All given filters must hold; an empty list of grades means any, graded or not.

    `poses` chooses no poses, but which of their boxes is written; `verdict` which grade counts.
    """

    model_config = ConfigDict(extra="forbid", populate_by_name=True)

    run_id: RowId | None = None
    site_id: RowId | None = None
    camera_id: RowId | None = None
    viewport_id: RowId | None = None
    image_id: RowId | None = None
    since: Moment | None = Field(
        None, alias="from", description="Images taken at this time or later; UTC without a zone"
    )
    until: Moment | None = Field(
        None, alias="to", description="Images taken before this time; UTC without a zone"
    )
    mmsi: Annotated[
        VesselRef | None, Field(description="Or the vessel's pseudonym at the site")
    ] = None
    grade: Grades | None = None
    state: State | None = Field(None, description="Where the reviewing of a pose stands")
    reviewer: RowId | None = Field(None, description="A person's id who graded")
    verdict: Verdict | None = Field(
        None,
        description=(
            "Which review counts. `standing`: as the pages count, a second opinion not before it "
            "is settled; `newest`: the last one given; `consensus`: one that all agree on or that "
            "settled a disagreement, else none"
        ),
    )
    range_min_m: Metres | None = Field(
        None, description="From the camera to the middle of the generated box, straight"
    )
    range_max_m: Metres | None = Field(
        None, description="As range_min_m; farther ones are left out"
    )
    flag: Annotated[str | None, Field(max_length=32, pattern=r"^[a-z_]+$")] = None
    corrected: bool | None = Field(None, description="Only poses that a person corrected, or not")
    person_made: bool | None = Field(None, description="Only poses that a person made, or not")
    poses: Annotated[
        Literal["generated", "corrected"] | None,
        Field(
            description="`corrected`: as people corrected them where they did; else as generated"
        ),
    ] = None
    updated_since: Moment | None = Field(
        None,
        description=(
            "Only poses whose line may have changed at this time or later: made, judged (reasons "
            "and comments too), corrected, restored, or on a photograph whose time was corrected. "
            "NDJSON also tells the ids of those that are gone since: deleted, made anew by their "
            "run, or no longer selected"
        ),
    )

    @model_validator(mode="after")
    def _leaves_something(self) -> Self:
        if self.since and self.until and self.since >= self.until:
            raise ValueError("`to` must be later than `from`")
        nearest, farthest = self.range_min_m, self.range_max_m
        if nearest is not None and farthest is not None and nearest >= farthest:
            raise ValueError("range_max_m must be larger than range_min_m")
        return self

    def stored(self) -> dict[str, Any]:
        """Return what was given as JSON values, in order of the names people give."""
        given = self.model_dump(mode="json", exclude_none=True, by_alias=True)
        return dict(sorted(given.items()))


class Split(BaseModel):
    """Training, validation and test parts that share no vessel and no convoy, or no day."""

    model_config = ConfigDict(extra="forbid")

    by: Literal["vessel", "day"]
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    train: Annotated[float, Field(ge=0, le=1)] = 0.7
    val: Annotated[float, Field(ge=0, le=1)] = 0.15
    test: Annotated[float, Field(ge=0, le=1)] = 0.15

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        if abs(self.train + self.val + self.test - 1) > 1e-6:
            raise ValueError("train, val and test must add up to 1")
        return self


class ExportOptions(BaseModel):
    """How the poses are packed."""

    model_config = ConfigDict(extra="forbid")

    images: bool = Field(False, description="With the photographs; makes a zip archive")
    archive: bool = Field(
        False,
        description="A zip archive with manifest and datasheet, also for a format of one file",
    )
    split: Split | None = None

    def stored(self) -> dict[str, Any]:
        """Return what differs from a plain export as JSON values."""
        return self.model_dump(mode="json", exclude_defaults=True)
