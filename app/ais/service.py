"""AIS: what other features and the command line may ask for."""

from app.ais.area import Area
from app.ais.reports import reports_between

__all__ = ["Area", "reports_between"]
