"""Conditions over many ids at once, as cheap for the database to read as it gets."""

from collections.abc import Sequence

import sqlalchemy as sa

WIDEST = 3  # short rows in a range so many times as wide cost a database less than a list


def among(column: sa.ColumnElement[int], ids: Sequence[int]) -> sa.ColumnElement[bool]:
    """Whether a column is one of some ids, which are in order; whole numbers, so written out."""
    if ids and ids[-1] - ids[0] == len(ids) - 1:
        return column.between(ids[0], ids[-1])
    return column.in_(sa.bindparam(None, list(ids), expanding=True, literal_execute=True))


def near(column: sa.ColumnElement[int], ids: Sequence[int]) -> sa.ColumnElement[bool]:
    """Whether a column is one of some ids in order, or, among short rows, one between them."""
    if ids and ids[-1] - ids[0] < WIDEST * len(ids):
        return column.between(ids[0], ids[-1])
    return among(column, ids)
