"""Shapes of runs in REST."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from app.clocks.schemas import WithheldOut
from app.domain.fusion_settings import PRESET_OF_RUNS
from app.runs.service import Progress
from app.runs.setting_words import described
from app.tables.runs import Run, RunStatus

NO_CONTROLS = r"^[^\x00-\x1f\x7f]*$"


class RunIn(BaseModel):
    """What a run shall do."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "viewport_id": 1,
                    "detector": "yolox-nano",
                    "preset": "waterline",
                    "parameters": {},
                }
            ]
        },
    )

    viewport_id: int
    detector: Annotated[
        str | None,
        Field(
            max_length=200,
            pattern=NO_CONTROLS,
            description="A ready model's name; else the newest one",
        ),
    ] = None
    preset: str = PRESET_OF_RUNS.value
    parameters: Annotated[dict[str, Any], Field(description=described())] = {}
    name: Annotated[str, Field(max_length=200, pattern=NO_CONTROLS)] = ""


class ImageErrorOut(BaseModel):
    """An image a run could not use, and why."""

    file_name: str
    reason: str


class RunOut(BaseModel):
    """A run and how far it is."""

    id: int
    name: str
    site_id: int
    viewport_id: int
    registration_id: int
    detector: str
    preset: str
    parameters: dict[str, Any]
    code_version: str
    status: RunStatus
    error: str | None
    images_total: int
    images_done: int
    images_failed: int
    images_per_s: float | None
    remaining_s: float | None
    detections: int
    matches: int
    poses: int
    is_stale: Annotated[
        bool, Field(description="Its viewport was registered anew since; start it again")
    ]
    is_reference: Annotated[
        bool, Field(description="Its site's other runs are compared with it by default")
    ]
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    image_errors: Annotated[
        list[ImageErrorOut], Field(description="The first images that failed; none in lists")
    ] = []
    withheld: Annotated[
        list[WithheldOut], Field(description="Matches it does not show, and why; none in lists")
    ] = []

    @classmethod
    def of(
        cls,
        run: Run,
        progress: Progress,
        image_errors: Sequence[tuple[str, str]] = (),
        withheld: Sequence[WithheldOut] = (),
    ) -> Self:
        """Put a run, its progress, failed images (file name, reason) and doubts together."""
        return cls(
            id=run.id,
            name=run.name,
            site_id=run.site_id,
            viewport_id=run.viewport_id,
            registration_id=run.registration_id,
            detector=run.model.name,
            preset=run.preset,
            parameters=run.parameters,
            code_version=run.code_version,
            status=run.status,
            error=run.error,
            images_total=progress.images_total,
            images_done=progress.images_done,
            images_failed=progress.images_failed,
            images_per_s=progress.images_per_s,
            remaining_s=progress.remaining_s,
            detections=progress.detections,
            matches=progress.matches,
            poses=progress.poses,
            is_stale=progress.is_stale,
            is_reference=progress.is_reference,
            created_at=run.created_at,
            started_at=run.started_at,
            finished_at=run.finished_at,
            image_errors=[
                ImageErrorOut(file_name=name, reason=reason) for name, reason in image_errors
            ],
            withheld=list(withheld),
        )
