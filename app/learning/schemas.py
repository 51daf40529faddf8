"""Shapes of learning in REST."""

from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

from app.learning.service import Proposal
from app.tables.learning import LearntSettings


class MissingOut(BaseModel):
    """How many more are needed before anything is fitted."""

    images: Annotated[int, Field(description="Images marked complete, all poses graded")]
    occasions: Annotated[int, Field(description="Groups of images an hour apart or more")]
    right: Annotated[int, Field(description="Poses graded as the right vessel")]


class ShareOut(BaseModel):
    """A share with its 95 % interval."""

    share: float
    low: float
    high: float
    of: int


class HeldOut(BaseModel):
    """Matches of occasions that were left out of the fit."""

    log_loss: Annotated[float | None, Field(description="A match; None without probabilities")]
    wrong: int
    right: int


class GainOut(BaseModel):
    """What the fitted settings are worth on images they were not fitted to."""

    now: Annotated[HeldOut, Field(description="As the graded runs matched")]
    fitted: HeldOut
    loss_change: Annotated[
        tuple[float, float, float] | None,
        Field(description="Of the log loss a match, with 95 % interval; negative is better"),
    ]
    is_better: bool


class ProposalOut(BaseModel):
    """What a site's graded images say; `fitted` and `gain` are null while they are too few."""

    key: Annotated[str, Field(description="Names this proposal when it is applied")]
    images: int
    occasions: int
    missing: MissingOut
    silent_share: Annotated[ShareOut, Field(description="Of the visible vessels: without AIS")]
    now: Annotated[dict[str, float], Field(description="What new runs take")]
    fitted: dict[str, float] | None
    gain: GainOut | None
    may_be_applied: bool

    @classmethod
    def of(cls, proposal: Proposal) -> Self:
        """Show a proposal."""
        gain = proposal.gain
        return cls(
            key=proposal.key,
            images=len(proposal.image_ids),
            occasions=proposal.occasions,
            missing=MissingOut(**asdict(proposal.missing)),
            silent_share=ShareOut(**asdict(proposal.silent)),
            now=dict(proposal.now),
            fitted=None if proposal.fitted is None else dict(proposal.fitted),
            gain=None if gain is None else GainOut(**asdict(gain), is_better=gain.is_better),
            may_be_applied=proposal.may_be_applied,
        )


class LearntIn(BaseModel):
    """Which proposal to apply."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"key": "0f3a9c1b22d4e5f6"}]}
    )

    key: Annotated[str, Field(min_length=1, max_length=64, description="Of the proposal seen")]


class LearntOut(BaseModel):
    """One set of a site's learnt settings; the newest that was not undone counts for new runs."""

    id: int
    site_id: int
    number: int
    settings: dict[str, float]
    basis: Annotated[
        dict[str, Any], Field(description="Images it was fitted to, and figures of those left out")
    ]
    created_at: datetime
    undone_at: datetime | None

    @classmethod
    def of(cls, row: LearntSettings) -> Self:
        """Show a row."""
        return cls(**{name: getattr(row, name) for name in cls.model_fields})
