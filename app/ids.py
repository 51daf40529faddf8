"""Ids as callers give them in filters and bodies: whole numbers that a column can hold."""

from typing import Annotated

from pydantic import BeforeValidator, Field

from app.domain.pseudonyms import is_pseudonym

LARGEST_ROW_ID = 2**31 - 1
LARGEST_WIDE_ID = 2**63 - 1
LARGEST_MMSI = 999_999_999

RowId = Annotated[int, Field(ge=1, le=LARGEST_ROW_ID)]
Mmsi = Annotated[int, Field(ge=1, le=LARGEST_MMSI)]


def _vessel(value: object) -> object:
    if isinstance(value, str):
        if is_pseudonym(value):
            return value
        value = int(value) if value.isascii() and value.isdigit() and len(value) < 20 else None
    if type(value) is int and 1 <= value <= LARGEST_MMSI:
        return value
    raise ValueError("give an MMSI of up to nine digits, or a pseudonym such as V-7KQ2MB5RXA3D")


VesselRef = Annotated[int | str, BeforeValidator(_vessel)]
