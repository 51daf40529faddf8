"""Requests and answers about batches."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Self

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, StringConstraints

from app.imports.preview import Odd, OddKind, Preview, names_of
from app.imports.proposals import Proposal
from app.imports.states import acts
from app.imports.times import TimeSettings
from app.sites.fields import Name, Request
from app.tables.imagery import CaptureTimeSource
from app.tables.imports import FileState, ImageImport, ImportStatus
from app.tables.sites import Viewport

MOST_ANNOUNCED = 2_000
SAMPLES = 8
EXAMPLES = 5
Sha256 = Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]


class ImportIn(Request):
    """A new batch."""

    camera_id: int
    name: Name = Field("Photographs", description="What people will know it by", examples=["July"])


class FileIn(Request):
    """A file that is to come: its path below what was chosen, and its size."""

    path: Annotated[str, StringConstraints(min_length=1, max_length=4096)] = Field(
        examples=["july/cam_20260701_101112.jpg"]
    )
    size_bytes: Annotated[int, Field(ge=0, lt=2**53)] = Field(examples=[320231])
    modified_at: AwareDatetime | None = None
    sha256: Sha256 | None = Field(
        None,
        description="If known: what the camera has already is not asked for",
        examples=["9a0364b9e99bb480dd25e1f0284c8555f0b9dd4b3b0f1f3c6d3a2f0d7d1c2e44"],
    )


class ManifestIn(Request):
    """Files that are to come; announcing one again tells how far it has come."""

    files: Annotated[list[FileIn], Field(min_length=1, max_length=MOST_ANNOUNCED)]


class FileOut(BaseModel):
    """A file of a batch; what is `waiting` is to be sent from `received_bytes` on."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    path: str
    state: FileState
    size_bytes: int
    received_bytes: int
    reason: str | None


class ManifestOut(BaseModel):
    """The announced files, in the order in which they were announced."""

    files: list[FileOut]


class ImportOut(BaseModel):
    """A batch: where it stands, how its files tell their times, and what may be done with it."""

    id: int
    site_id: int
    camera_id: int
    name: str
    status: ImportStatus
    times: TimeSettings
    image_count: int
    created_at: datetime
    committed_at: datetime | None
    undone_at: datetime | None
    version: int
    may: list[str] = Field(description="What its status allows", examples=[["commit", "discard"]])

    @classmethod
    def of(cls, row: ImageImport) -> Self:
        """Show a row."""
        names = cls.model_fields.keys() - {"may", "times"}
        return cls(
            may=[act.name.lower() for act in acts(row.status)],
            times=TimeSettings.model_validate(row.times),
            **{name: getattr(row, name) for name in names},
        )


class ExampleOut(BaseModel):
    """A file with what is odd about it."""

    path: str
    detail: str


class OddOut(BaseModel):
    """Something odd, how often, and the first few files it was found at."""

    kind: OddKind
    count: int
    examples: list[ExampleOut]

    @classmethod
    def of(cls, odd: Odd, most_examples: int) -> Self:
        """Show an oddity."""
        shown = odd.found[:most_examples]
        examples = [ExampleOut(path=path, detail=detail) for path, detail in shown]
        return cls(kind=odd.kind, count=odd.count, examples=examples)


class ViewportShareOut(BaseModel):
    """How many images fall to a viewport; without one, to none."""

    viewport_id: int | None
    name: str
    count: int


class SampleOut(BaseModel):
    """A file with the moment it will have."""

    path: str
    captured_at: datetime
    captured_at_source: CaptureTimeSource


class ProposalOut(BaseModel):
    """A pattern that names seem to follow; `swapped` reads them too, day and month exchanged."""

    model_config = ConfigDict(from_attributes=True)

    pattern: str
    name_count: int
    swapped: str | None
    example: str
    example_time: datetime


class PreviewOut(BaseModel):
    """What committing a batch would do."""

    ready_count: int
    left_out_count: int
    waiting_count: int
    waiting_bytes: int
    first_at: datetime | None
    last_at: datetime | None
    sources: dict[CaptureTimeSource, int]
    viewports: list[ViewportShareOut]
    odd: list[OddOut]
    samples: list[SampleOut]
    proposals: list[ProposalOut]

    @classmethod
    def of(
        cls,
        made: Preview,
        viewports: Sequence[Viewport],
        proposals: Sequence[Proposal],
        most_examples: int = EXAMPLES,
    ) -> Self:
        """Show a preview."""
        names = names_of(viewports)
        shares = sorted(made.per_viewport.items(), key=lambda share: (share[0] is None, share[0]))
        step = max(1, len(made.ready) // SAMPLES)
        return cls(
            ready_count=len(made.ready),
            left_out_count=made.left_out_count,
            waiting_count=made.waiting_count,
            waiting_bytes=made.waiting_bytes,
            first_at=made.ready[0].true_time if made.ready else None,
            last_at=made.ready[-1].true_time if made.ready else None,
            sources=made.sources,
            viewports=[
                ViewportShareOut(
                    viewport_id=key, name="no viewport" if key is None else names[key], count=count
                )
                for key, count in shares
            ],
            odd=[OddOut.of(made.odd[kind], most_examples) for kind in OddKind if kind in made.odd],
            samples=[
                SampleOut(
                    path=item.file.path,
                    captured_at=item.true_time,
                    captured_at_source=item.told.source,
                )
                for item in made.ready[::step][:SAMPLES]
            ],
            proposals=[ProposalOut.model_validate(proposal) for proposal in proposals],
        )


class CommitIn(Request):
    """Make images of a batch."""

    leave_out_waiting: bool = Field(
        default=False, description="Commit although announced files have not come"
    )


class MoveIn(Request):
    """Give a batch to another camera."""

    camera_id: int


class TakesAlongOut(BaseModel):
    """What disappears with a batch's images, and comes back with them."""

    images: int
    poses: int
    runs: int
    reviews: int
    corrections: int


class TimesTableOut(BaseModel):
    """What a table of times was worth."""

    matched: int
    unknown_names: list[str]
    unknown_count: int
