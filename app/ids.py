"""Ids as callers give them in filters and bodies: whole numbers that a column can hold."""

from typing import Annotated

from pydantic import Field

LARGEST_ROW_ID = 2**31 - 1
LARGEST_WIDE_ID = 2**63 - 1
LARGEST_MMSI = 999_999_999

RowId = Annotated[int, Field(ge=1, le=LARGEST_ROW_ID)]
Mmsi = Annotated[int, Field(ge=1, le=LARGEST_MMSI)]
