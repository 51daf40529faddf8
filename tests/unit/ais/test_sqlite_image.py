"""Tables as the bytes of an SQLite database, read back by SQLite."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from app.ais.sqlite_image import TABLE, database_image


@pytest.mark.parametrize("rows", [1, 541, 542, 543, 40_000])
def test_sqlite_reads_the_rows_of_an_image(rows: int) -> None:
    """Of one page and of many, SQLite finds the same values in the same order."""
    rng = np.random.default_rng(rows)
    numbers = rng.integers(-(2**31), 2**31, rows)
    reals = np.where(rng.random(rows) < 0.2, np.nan, rng.normal(size=rows))
    moments = rng.integers(-(2**63), 2**63, rows, dtype=np.int64)
    codes = rng.integers(0, 128, rows).astype(np.uint8)
    columns = {"i": numbers.astype(np.int32), "f": reals, "m": moments, "c": codes}
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.execute("ATTACH ':memory:' AS image")
        connection.execute("BEGIN")
        connection.deserialize(database_image(columns), name="image")
        found = connection.execute(f"SELECT i, f, m, c FROM image.{TABLE}").fetchall()  # noqa: S608  a constant
    assert found == list(
        zip(
            numbers.tolist(),
            [None if real != real else real for real in reals.tolist()],  # noqa: PLR0124  NaN
            moments.tolist(),
            codes.tolist(),
            strict=True,
        )
    )


def test_too_many_rows_for_an_image_are_refused() -> None:
    """More rows than a tree of two levels holds raise an error that names their number."""
    with pytest.raises(ValueError, match="500001 rows"):
        database_image({"c": np.zeros(500_001, dtype=np.uint8)})
