"""Moments as addresses give them: ISO 8601, in UTC where they say no zone."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import Query
from pydantic import AfterValidator


def _in_utc(moment: datetime) -> datetime:
    try:
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("give a moment between the years 1 and 9999 in UTC") from error


Moment = Annotated[datetime, AfterValidator(_in_utc)]
From = Annotated[Moment | None, Query(alias="from", description="ISO 8601; UTC without a zone")]
To = Annotated[Moment | None, Query(alias="to", description="ISO 8601; UTC without a zone")]
