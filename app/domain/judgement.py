"""The grade a pose deserves by a simulator's truth, for newcomers to practise on.

A reviewer sees pixels, so position is judged in the image: how far the foot of the box is off, as a
share of the visible vessel's box. Heading, height and length are judged against the true ones. The
limits put the guideline's words into numbers and are ours; the paper gives only one, that a heading
error of about 10 degrees is not Good. Poses near a limit are not clear cases: trained people differ
there too, and a calibration set leaves them out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.domain.arrays import FloatArray

UNCLEAR = 0.2
"""An error within this share of a limit makes a case unclear."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Up to the first an error is Good, up to the second OK, beyond it Bad."""

    good: float
    ok: float


LIMITS = {
    "position": Limits(0.08, 0.25),  # of the larger side of the vessel's box in the image
    "heading": Limits(10.0, 25.0),  # degrees
    "height": Limits(0.25, 0.60),  # of the true height
    "size": Limits(0.15, 0.40),  # of the true length
}
GRADES = ("good", "ok", "bad")


@dataclass(frozen=True, slots=True)
class BoxErrors:
    """How a box differs from the true one, in the units of `LIMITS`."""

    position: float
    heading_deg: float
    height: float
    length: float


@dataclass(frozen=True, slots=True)
class Judgement:
    """The grade, its reasons, why in words, and whether it is a clear case."""

    grade: str
    reasons: tuple[str, ...]
    note: str
    clear: bool


def foot_offset(foot_px: FloatArray, true_foot_px: FloatArray, box_px: Sequence[float]) -> float:
    """Return how far the foot of a box (4 corners, px) is off, as a share of the vessel's box."""
    away_px = float(np.linalg.norm(np.mean(foot_px, axis=0) - np.mean(true_foot_px, axis=0)))
    return away_px / max(box_px[2] - box_px[0], box_px[3] - box_px[1], 1.0)


def judge_box(errors: BoxErrors) -> Judgement:
    """Grade the box of the right vessel by its errors; the worst of them decides."""
    sizes = {
        "position": errors.position,
        "heading": errors.heading_deg,
        "height": abs(errors.height),
        "size": abs(errors.length),
    }
    steps = {name: _step(sizes[name], limits) for name, limits in LIMITS.items()}
    worst = max(steps.values())
    note = (
        f"Right vessel. Foot of the box off by {errors.position:.0%} of the vessel's extent in "
        f"the image, heading by {errors.heading_deg:.0f}°, height {errors.height:+.0%}, "
        f"length {errors.length:+.0%}."
    )
    return Judgement(
        grade=GRADES[worst],
        reasons=tuple(name for name, step in steps.items() if step == worst) if worst else (),
        note=note,
        clear=all(_is_clear(sizes[name], limits) for name, limits in LIMITS.items()),
    )


def judge_mismatch(seen: str | None, *, seen_has_ais: bool, said: str) -> Judgement:
    """Judge a box whose AIS is not of the vessel under the detection; `seen` None: no vessel."""
    if seen is None:
        note = f"The detection shows no vessel; the box is of {said}."
        return Judgement("wrong", ("false_positive",), note, clear=True)
    if not seen_has_ais:
        note = f"The visible vessel {seen} sends no AIS data; the box is of {said}."
        return Judgement("wrong", ("missing_ais",), note, clear=True)
    note = f"The visible vessel is {seen}; the box is of {said}."
    return Judgement("wrong", ("cost_function",), note, clear=True)


def _step(error: float, limits: Limits) -> int:
    return int(error > limits.good) + int(error > limits.ok)


def _is_clear(error: float, limits: Limits) -> bool:
    return all(abs(error - limit) > UNCLEAR * limit for limit in (limits.good, limits.ok))
