"""How many images there are of something, and when they were taken."""

from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True, slots=True)
class ImageSpan:
    """How many images there are, and when the first and the last were taken."""

    count: int
    first_at: datetime | None
    last_at: datetime | None
