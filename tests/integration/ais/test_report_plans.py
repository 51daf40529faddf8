"""Reports near a camera are found by the indexes that grow with what is near, not with all."""

from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.ais.area import Area
from app.ais.reports import reports_between
from app.db import Database
from tests.factories.ais import NOON


def test_reports_around_a_camera_are_searched_by_place_and_arrival(database: Database) -> None:
    """SQLite looks cells up with the time, and suspect receivers' reports by their arrival."""
    if not database.is_sqlite:
        pytest.skip("plans of SQLite are stable; Postgres plans by its statistics")
    with database.reading() as session:
        plans = list(plans_of_positions(session))
    searches = (
        "INDEX ix_ais_positions_hour_cell_time (hour=? AND cell=? AND fix_time>? AND fix_time<?)",
        "INDEX ix_ais_positions_suspect_arrival (arrived_at>? AND arrived_at<?)",
    )
    assert all(search in plan for search, plan in zip(searches, plans, strict=True)), plans


def plans_of_positions(session: Session) -> Iterator[str]:
    """Yield how SQLite searches positions for what was heard around a camera."""
    asked: list[tuple[str, Any]] = []
    connection = session.connection()

    @sa.event.listens_for(connection, "before_cursor_execute")
    def _note(_connection: object, _cursor: object, sql: str, values: object, *_: object) -> None:
        asked.append((sql, values))

    area = Area.around(53.5, 9.9, 10_000)
    reports_between(session, 1, NOON, NOON + timedelta(minutes=6), area)
    sa.event.remove(connection, "before_cursor_execute", _note)
    for sql, values in asked:
        if "FROM ais_positions" in sql:
            rows = connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {sql}", values)
            yield " ".join(row[3] for row in rows)
