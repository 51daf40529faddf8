"""AIS: what other features and the command line may ask for."""

from app.ais.area import Area
from app.ais.reports import ReportWindow, reports_between

__all__ = ["Area", "ReportWindow", "reports_between"]
