"""Shapes of what goes on by itself in REST."""

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from app.domain.fusion_settings import PRESET_OF_RUNS
from app.ids import RowId
from app.tables.live import StandingRun, WatchedFolder

NO_CONTROLS = r"^[^\x00-\x1f\x7f]*$"


class FolderIn(BaseModel):
    """A folder on the workers' machines whose photographs are a camera's."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"path": "/srv/cameras/gable"}]}
    )

    path: Annotated[str, Field(min_length=1, max_length=1000, pattern=NO_CONTROLS)]
    moves_files: Annotated[
        bool, Field(description="Move each file to done or failed below the folder")
    ] = False


class FolderOut(BaseModel):
    """A watched folder; `files` counts them by what became of them."""

    id: int
    camera_id: int
    path: str
    moves_files: bool
    paused_at: datetime | None
    looked_at: datetime | None
    trouble: str | None
    version: int
    files: dict[str, int]

    @classmethod
    def of(cls, row: WatchedFolder, files: dict[str, int]) -> Self:
        """Show a row."""
        names = [name for name in cls.model_fields if name != "files"]
        return cls(files=files, **{name: getattr(row, name) for name in names})


class StandingIn(BaseModel):
    """What shall be done with a viewport's images as they come."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"viewport_id": 1, "preset": "waterline"}]}
    )

    viewport_id: RowId
    detector: Annotated[str | None, Field(max_length=200, pattern=NO_CONTROLS)] = None
    preset: str = PRESET_OF_RUNS.value
    parameters: dict[str, Any] = {}
    name: Annotated[str, Field(max_length=200, pattern=NO_CONTROLS)] = ""
    ais_wait_s: Annotated[
        float, Field(description="Images younger than this are fused again when AIS comes late")
    ] = 86_400.0


class StandingOut(BaseModel):
    """A standing run; `run_id` is the run that grows."""

    id: int
    viewport_id: int
    run_id: int | None
    name: str
    preset: str
    parameters: dict[str, Any]
    ais_wait_s: float
    paused_at: datetime | None
    looked_at: datetime | None
    trouble: str | None
    version: int

    @classmethod
    def of(cls, row: StandingRun) -> Self:
        """Show a row."""
        return cls(**{name: getattr(row, name) for name in cls.model_fields})


class DropTokenOut(BaseModel):
    """A token that does nothing but drop photographs of one camera; shown this once."""

    token: str
    camera_id: int
    expires_at: datetime
