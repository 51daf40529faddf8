"""Why a job failed, in words for the person who started it."""

import pytest
import sqlalchemy as sa

from app.detectors.onnx_file import ModelFileError
from app.errors import NotFound
from app.jobs import LONGEST_REASON, reason_of


class EmptyError(Exception):
    """An error without a word."""


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (NotFound("the file is gone"), "the file is gone"),
        (ModelFileError("this is a zip archive"), "this is a zip archive"),
        (ValueError("bad number\nin line 3"), "ValueError: bad number"),
        (KeyError("corners"), "KeyError: 'corners'"),
        (EmptyError(), "EmptyError: no reason given"),
    ],
)
def test_a_reason_is_one_line(error: Exception, reason: str) -> None:
    """Our own errors speak for themselves; others are named, and only their first line is told."""
    assert reason_of(error) == reason


def test_a_database_error_tells_no_statement() -> None:
    """The reason holds neither SQL nor the values that were to be stored."""
    error = sa.exc.IntegrityError(
        "INSERT INTO poses VALUES (?)", {"mmsi": 211234560}, Exception("UNIQUE failed: poses.id")
    )
    reason = reason_of(error)
    assert "UNIQUE failed: poses.id" in reason
    assert "INSERT" not in reason
    assert "211234560" not in reason


def test_a_long_reason_is_cut() -> None:
    """A library that prints its world is heard for a few hundred letters."""
    assert len(reason_of(RuntimeError("x" * 100_000))) <= LONGEST_REASON + len("RuntimeError: ")
