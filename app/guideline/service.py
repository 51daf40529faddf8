"""The guideline with its pictures, as the review and the guideline's own page show it."""

from dataclasses import dataclass

from app.domain.guideline import GUIDELINES, Guideline, current_guideline
from app.errors import NotFound
from app.guideline.pictures import HEIGHT_PX, WIDTH_PX, Picture, pictures


@dataclass(frozen=True, slots=True)
class Illustrated:
    """A guideline and the drawn examples of each grade."""

    text: Guideline
    pictures: dict[str, tuple[Picture, ...]]
    width_px: int = WIDTH_PX
    height_px: int = HEIGHT_PX


def current() -> Illustrated:
    """Return the guideline that new reviews are made under."""
    return Illustrated(current_guideline(), pictures())


def of_version(version: int) -> Illustrated:
    """Return an earlier guideline, or the present one. Raises NotFound."""
    text = GUIDELINES.get(version)
    if text is None:
        raise NotFound("there is no such version of the guideline")
    return Illustrated(text, pictures())
