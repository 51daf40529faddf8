"""Fit what is probable at a site to its graded images, and keep the sets that people applied.

A proposal is computed when it is asked for and stored by nobody. Its key names the numbers and the
images they rest on, so that a person applies what they saw and nothing that came since.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.db import now
from app.domain.fusion_settings import FusionSettings
from app.domain.prior_gain import (
    Gain,
    Missing,
    SilentShare,
    held_out_gain,
    missing,
    occasions,
    silent_share,
)
from app.domain.priors import Priors, fit_priors
from app.errors import Conflict, NotFound
from app.learning import repository
from app.learning.graded import graded_images
from app.tables.learning import LearntSettings

_DIGITS = 4


@dataclass(frozen=True, slots=True)
class Proposal:
    """What a site's graded images say; `fitted` and `gain` are None while they are too few.

    `now` are the settings that new runs take; `key` names this proposal.
    """

    image_ids: Sequence[int]
    occasions: int
    missing: Missing
    silent: SilentShare
    now: Mapping[str, float]
    fitted: Mapping[str, float] | None
    gain: Gain | None
    key: str

    @property
    def may_be_applied(self) -> bool:
        """Whether the numbers are better on images they were not fitted to, and are new."""
        fitted = self.fitted or {}
        is_new = any(self.now[name] != value for name, value in fitted.items())
        return self.gain is not None and self.gain.is_better and is_new


def propose(session: Session, site_id: int) -> Proposal:
    """Fit a site's graded images and judge the result on images left out."""
    images = graded_images(session, site_id)
    lacking = missing(images)
    fitted = None if lacking.anything else _rounded(fit_priors(images))
    ids = sorted(image.id for image in images)
    return Proposal(
        image_ids=ids,
        occasions=len(occasions(images)),
        missing=lacking,
        silent=silent_share(images),
        now=settings_in_use(session, site_id),
        fitted=fitted,
        gain=None if lacking.anything else held_out_gain(images),
        key=hashlib.sha256(json.dumps([ids, fitted]).encode()).hexdigest()[:16],
    )


def _rounded(priors: Priors) -> Mapping[str, float]:
    return {name: round(value, _DIGITS) for name, value in priors.as_settings().items()}


def learnt_settings(session: Session, site_id: int) -> Mapping[str, float]:
    """Return the learnt settings that count for a site's new runs; empty where there are none."""
    counting = next((row for row in repository.learnt(session, site_id) if not row.undone_at), None)
    return {} if counting is None else counting.settings


def settings_in_use(session: Session, site_id: int) -> Mapping[str, float]:
    """Return what new runs take of all that may be learnt."""
    usual = FusionSettings()
    learnt = learnt_settings(session, site_id)
    return {name: learnt.get(name, getattr(usual, name)) for name in Priors.__slots__}


def history(session: Session, site_id: int) -> Sequence[LearntSettings]:
    """Return a site's sets, newest first."""
    return repository.learnt(session, site_id)


def get_learnt(session: Session, learnt_id: int) -> LearntSettings:
    """Return a set. Raises NotFound."""
    row = repository.get(session, learnt_id)
    if row is None:
        raise NotFound("there are no such learnt settings")
    return row


def apply(session: Session, site_id: int, key: str, user_id: int | None) -> LearntSettings:
    """Make a proposal count for a site's new runs. Raises Conflict where it may not."""
    proposal = propose(session, site_id)
    if proposal.key != key:
        raise Conflict("the graded images changed since: look at the new proposal, then apply it")
    if proposal.fitted is None or proposal.gain is None or not proposal.may_be_applied:
        raise Conflict(
            "the fitted numbers are not better on images they were not fitted to: "
            "grade more images, then look again"
        )
    row = LearntSettings(
        site_id=site_id,
        number=1 + max((row.number for row in repository.learnt(session, site_id)), default=0),
        settings=dict(proposal.fitted),
        basis=_basis(proposal, proposal.gain),
        created_by_id=user_id,
    )
    session.add(row)
    session.flush()
    return row


def _basis(proposal: Proposal, gain: Gain) -> dict[str, Any]:
    return {
        "key": proposal.key,
        "image_ids": list(proposal.image_ids),
        "occasions": proposal.occasions,
        "silent_share": asdict(proposal.silent),
        "held_out": asdict(gain),
    }


def undo(session: Session, row: LearntSettings) -> None:
    """Take a set back: the one before it counts again. Raises Conflict when it was undone."""
    if row.undone_at is not None:
        raise Conflict("these learnt settings were undone already")
    row.undone_at = now()
    session.flush()
