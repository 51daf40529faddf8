"""Tables of when photographs were taken."""

from datetime import UTC, datetime, timedelta, timezone

import pytest

from app.errors import Invalid
from app.imports.times_table import matched, read_times

SHOWN = datetime(2026, 7, 31, 10, 11, 12)  # noqa: DTZ001  as a table tells it
ZONED = SHOWN.replace(tzinfo=UTC)


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("\ufeffDateiname;Zeitstempel\na.jpg;31.07.2026 10:11:12,0\n", SHOWN),
        ("sep=;\nid;DateTimeOriginal;FileName\n1;2026:07:31 10:11:12;a.jpg\n", SHOWN),
        ("Date,Time,File\n2026-07-31,10:11:12,a.jpg\n", SHOWN),
        ("file,time (UTC)\na.jpg,7/31/2026 10:11:12 AM\n", ZONED),
        ("file,epoch\na.jpg,1785492672\n", ZONED),
        ("2026-07-31T10:11:12Z\ta.jpg\n", ZONED),
        (
            "a.jpg,2026-07-31 15:56:12+05:45\n",
            SHOWN.replace(hour=15, minute=56, tzinfo=timezone(timedelta(hours=5, minutes=45))),
        ),
        ("a.jpg,20260731101112\na.jpg,20260731101112\n", SHOWN),
    ],
)
def test_tables_of_many_makes_are_read(text: str, moment: datetime) -> None:
    """Separators, names of columns, their order and ways to write a time do not matter."""
    assert read_times(text) == {"a.jpg": moment}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("file,time\na.jpg,03/04/2026 10:11\n", "line 2.*day or the month first"),
        ("a.jpg,2026-07-01 10:00\na.jpg,2026-07-01 11:00\n", "line 2.*another time in line 1"),
        ("a.jpg,2026-07-01 10:00\nb.jpg,2026-07-01\n", "line 2.*day without a time"),
        ("a.jpg,2026-07-01 10:00\nb.jpg,\n", "line 2.*no time"),
        ("a.jpg\n", "two columns"),
        ("", "empty"),
    ],
)
def test_what_may_mean_two_moments_is_refused_by_its_line(text: str, says: str) -> None:
    """Nothing of a table is taken that has a line which a person has to decide."""
    with pytest.raises(Invalid, match=says):
        read_times(text)


def test_names_with_folders_of_another_machine_find_their_files() -> None:
    """The name that shares most folders counts; one that contradicts them does not."""
    listed = read_times("C:\\p\\july\\A.JPG;2026-07-01 10:00\n./june/a.jpg;2026-06-01 10:00\n")
    found = dict(matched(listed, ["july/a.jpg", "june/a.jpg", "may/a.jpg", "a.jpg"]))
    assert found == {"july/a.jpg": "p/july/A.JPG", "june/a.jpg": "june/a.jpg"}
