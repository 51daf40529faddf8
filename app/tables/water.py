"""How high the water of a site stood when."""

from datetime import datetime
from enum import StrEnum

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from app.db import Base
from app.tables.ais import WideId
from app.tables.deletion import DeletableAlone, index_of_deleted, unique_among_present


class WaterLevelSource(StrEnum):
    """Where a water level comes from."""

    CONSTANT = "constant"  # the site's own: there is no series
    SERIES = "series"  # between two readings of the series
    GAP = "gap"  # the site's own: the series has no readings around that time


class WaterLevel(DeletableAlone, Base):
    """One reading of a gauge: metres above the WGS84 ellipsoid at a moment."""

    __tablename__ = "water_levels"

    id: Mapped[int] = mapped_column(WideId, primary_key=True)
    site_id: Mapped[int] = mapped_column(sa.ForeignKey("sites.id", ondelete="CASCADE"))
    measured_at: Mapped[datetime]
    level_m: Mapped[float]

    __table_args__ = (
        unique_among_present("water_levels", "site_id", "measured_at"),
        index_of_deleted("water_levels"),
    )
