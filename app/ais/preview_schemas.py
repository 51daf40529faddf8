"""Answers about recordings that are not imported yet, and the form that maps a table's columns."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from app.ais.part import Report
from app.ais.preview import Preview, RejectSeen
from app.ais.recording import told_of
from app.ais.schemas import AccountingOut, LeftOutOut
from app.domain.ais import PositionReport
from app.domain.table_mapping import FIELDS, MappingError, TableMapping
from app.domain.table_proposal import Proposal
from app.errors import Invalid

_LONGEST_TEXT = 300
# What each column may be said to hold, in words.
FIELD_NAMES = {
    "mmsi": "MMSI",
    "time": "Time",
    "clock": "Time of day",
    "lat": "Latitude",
    "lon": "Longitude",
    "sog": "Speed",
    "cog": "Course",
    "heading": "Heading",
    "rot": "Rate of turn",
    "to_bow": "To bow (A)",
    "to_stern": "To stern (B)",
    "to_port": "To port (C)",
    "to_starboard": "To starboard (D)",
    "length": "Length",
    "width": "Width",
    "name": "Name",
    "callsign": "Call sign",
    "imo": "IMO number",
    "ship_type": "Ship type",
    "ais_class": "Class A or B",
}
_OPTIONS = ("delimiter", "decimal", "time_format", "timezone", "speed_unit")


class TextOut(BaseModel):
    """A text of the recording: its name in an archive (else empty), and its format."""

    entry: str
    format: str


class ReportOut(BaseModel):
    """One of the first reports."""

    kind: str = Field(description="position or static")
    mmsi: int
    at: datetime
    lat_deg: float | None
    lon_deg: float | None
    sog_kn: float | None
    cog_deg: float | None
    heading_deg: float | None
    name: str | None

    @classmethod
    def of(cls, report: Report) -> "ReportOut":
        """Show a report."""
        if isinstance(report, PositionReport):
            return cls(
                kind="position",
                mmsi=report.mmsi,
                at=report.fix_time,
                lat_deg=report.lat_deg,
                lon_deg=report.lon_deg,
                sog_kn=report.sog_kn,
                cog_deg=report.cog_deg,
                heading_deg=report.heading_deg,
                name=None,
            )
        return cls(
            kind="static",
            mmsi=report.mmsi,
            at=report.received_at,
            lat_deg=None,
            lon_deg=None,
            sog_kn=None,
            cog_deg=None,
            heading_deg=None,
            name=report.name,
        )


class RejectOut(BaseModel):
    """A line that would not be taken."""

    entry: str
    line: int
    reason: str
    meaning: str
    text: str

    @classmethod
    def of(cls, seen: RejectSeen) -> "RejectOut":
        """Show a rejected line."""
        reject = seen.reject
        text = reject.text.decode("utf-8", "replace")
        return cls(
            entry=seen.entry,
            line=reject.line,
            reason=reject.reason,
            meaning=reject.message,
            text=text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}…",
        )


class TableOut(BaseModel):
    """How a table seems to be made; `mapping` may be sent along with the import, changed or not.

    Its `time_format` is empty, and has to be said, where dates may have the day or the month first.
    """

    kind: str
    header: list[str]
    rows: list[list[str]]
    mapping: dict[str, Any]
    missing: list[str] = Field(description="Columns that no position can do without")
    doubts: list[str]

    @classmethod
    def of(cls, proposal: Proposal, mapping: TableMapping | None) -> "TableOut":
        """Show a proposal, or what somebody said instead."""
        used = mapping or proposal.mapping
        told = used.as_dict()
        if proposal.unsure_date and used == proposal.mapping:
            told["time_format"] = ""
        return cls(
            kind=proposal.kind,
            header=proposal.header,
            rows=proposal.rows[:5],
            mapping=told,
            missing=used.missing,
            doubts=[] if mapping and mapping != proposal.mapping else proposal.doubts,
        )


class PreviewOut(BaseModel):
    """The first lines of a recording, decoded without storing anything."""

    texts: list[TextOut]
    accounting: AccountingOut
    is_whole: bool = Field(description="Whether there are no more lines than these")
    vessels: int
    first: datetime | None
    last: datetime | None
    reports: list[ReportOut]
    rejects: list[RejectOut] = Field(description="Up to three of each reason")
    table: TableOut | None
    problem: str
    left_out: LeftOutOut = Field(description="Entries of an archive that are no recordings")

    @classmethod
    def of(cls, seen: Preview) -> "PreviewOut":
        """Show a preview."""
        return cls(
            texts=[TextOut(entry=text.entry, format=text.format) for text in seen.texts],
            accounting=AccountingOut.model_validate(seen.accounting.as_dict()),
            is_whole=seen.is_whole,
            vessels=seen.vessel_count,
            first=seen.first,
            last=seen.last,
            reports=[ReportOut.of(report) for report in seen.reports],
            rejects=[RejectOut.of(reject) for reject in seen.rejects],
            table=TableOut.of(seen.table, seen.mapping) if seen.table else None,
            problem=seen.problem,
            left_out=LeftOutOut.model_validate(told_of(seen.left_out)),
        )


def mapping_of_form(values: Mapping[str, str]) -> TableMapping:
    """Read a mapping from a form: `column.N` names what column N holds. Raises Invalid."""
    columns: dict[str, int] = {}
    for name, field in values.items():
        number = name.removeprefix("column.")
        if number == name or not field:
            continue
        if not (number.isascii() and number.isdigit()) or field not in FIELDS:
            raise Invalid.field(name, "choose one of the list")
        if field in columns:
            raise Invalid.field(name, f"{FIELD_NAMES[field]} is another column already")
        columns[field] = int(number)
    data: dict[str, Any] = {name: values[name] for name in _OPTIONS if name in values}
    if data.get("delimiter") != values.get("shown_delimiter"):
        columns = {}  # they are other columns now, to be proposed anew
    data |= {"columns": columns, "has_header": values.get("has_header") == "true"}
    try:
        return TableMapping.of(data, is_whole=False)
    except MappingError as error:
        raise Invalid.field(error.field, str(error)) from error
