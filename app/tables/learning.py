"""What a site's graded images taught, as settings for its next runs."""

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base, Json, now


class LearntSettings(Base):
    """One set of a site's learnt settings, numbered from 1; rows are never changed.

    Of those not undone the newest counts for new runs. `settings` are fields of FusionSettings;
    `basis` says what they rest on: images, held-out figures, and the key they were shown under.
    """

    __tablename__ = "learnt_settings"

    id: Mapped[int] = mapped_column(primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    number: Mapped[int]
    settings: Mapped[dict[str, Any]] = mapped_column(Json)
    basis: Mapped[dict[str, Any]] = mapped_column(Json)
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by_id: Mapped[int | None] = mapped_column(
        sa.ForeignKey("users.id", ondelete="SET NULL")
    )
    undone_at: Mapped[datetime | None]

    __table_args__ = (sa.UniqueConstraint("site_id", "number"),)
