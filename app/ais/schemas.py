"""Answers about AIS recordings. Units stand in the names; null stands for "not available"."""

from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from app.identities.shown import Identities
from app.tables.ais import AisFile

_ACCOUNTING_EXAMPLE = {
    "lines": {"total": 4, "sentence": 3, "time_only": 1, "other": 0, "dropped": 0},
    "sentences": {"total": 3, "assembled": 2, "rejected": {"checksum": 1}, "orphaned": 0},
    "messages": {
        "assembled": 2,
        "positions": 1,
        "statics": 0,
        "duplicates": 1,
        "ignored_type": 0,
        "rejected": {},
    },
}


class AccountingOut(BaseModel):
    """What became of every line, sentence and message; each of the three sums is exact."""

    lines: dict[str, int]
    sentences: dict[str, Any]
    messages: dict[str, Any]


class LeftOutEntry(BaseModel):
    """An entry of an archive that is no recording, and why."""

    entry: str
    reason: str


class LeftOutOut(BaseModel):
    """The entries of an archive that were left out: how many, and the first fifty of them."""

    count: int = 0
    first: list[LeftOutEntry] = []


class AisFileOut(BaseModel):
    """An imported recording."""

    id: int
    site_id: int | None = Field(description="null: shared by all sites")
    file_name: str
    format: str = Field(
        description="nmea, csv, nmea+gzip, csv+gzip, or an archive such as zip(csv,nmea)"
    )
    sha256: str
    size_bytes: int
    accounting: AccountingOut = Field(examples=[_ACCOUNTING_EXAMPLE])
    left_out: LeftOutOut = Field(
        description="What an archive holds beside recordings; the accounting counts none of it"
    )
    vessels: int = Field(description="How many vessels it speaks of")
    first: datetime | None
    last: datetime | None
    created_at: datetime

    @classmethod
    def of(cls, file: AisFile, told: Identities) -> "AisFileOut":
        """Show a row; a file's name may tell a vessel, and so may an entry's."""
        left_out = LeftOutOut.model_validate(file.accounting.get("left_out", {}))
        if told.hidden:
            left_out.first = []
        return cls(
            id=file.id,
            site_id=file.site_id,
            file_name=told.name(file.file_name) or f"Recording {file.id}",
            format=file.format,
            sha256=file.sha256,
            size_bytes=file.size_bytes,
            accounting=AccountingOut.model_validate(file.accounting),
            left_out=left_out,
            vessels=file.accounting.get("vessels", 0),
            first=file.first_at,
            last=file.last_at,
            created_at=file.created_at,
        )
