"""Patterns found in the names of files."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.imports.proposals import propose
from app.sites.name_pattern import check_pattern

PRESENT = datetime(2026, 11, 22, tzinfo=UTC)
TAKEN = datetime(2026, 7, 31, 10, 11, 12)  # noqa: DTZ001  as a name tells it


@pytest.mark.parametrize(
    ("written", "pattern"),
    [
        ("quay_%d-%m-%Y_%H.%M.%S (2)", "%d-%m-%Y_%H.%M.%S"),
        ("IMG_%Y%m%d_%H%M%S", "%Y%m%d_%H%M%S"),
        ("cam-%y%m%d-%H%M%S", "%y%m%d-%H%M%S"),
        ("192.168.1.64_01_%Y%m%d%H%M%S123_MOTION", "%Y%m%d%H%M%S%f"),
        ("%m-%d-%Y_%H%M", "%m-%d-%Y_%H%M"),
        ("%Y-%m-%dT%H-%M-%S.500Z_x", "%Y-%m-%dT%H-%M-%S.%f%z"),
        ("harbour-%Y-%m-%dT%H-%M-%S-7", "%Y-%m-%dT%H-%M-%S"),
        ("1785492672", "%s"),
        ("%Y-%m-%d/%H-%M-%S", "%Y-%m-%d/%H-%M-%S"),
        ("%Y%j_%H%M%S", "%Y%j_%H%M%S"),
        ("1785492672500", "%s%f"),
    ],
)
def test_the_pattern_of_names_is_found(written: str, pattern: str) -> None:
    """Whatever recorders put around it, the reading that makes most sense is proposed."""
    days = [TAKEN + timedelta(days=day, minutes=7 * day) for day in range(-18, 0)]
    names = [f"{day.strftime(written)}.jpg" for day in days] if "%" in written else [written]
    best = propose(names, PRESENT)[0]
    assert (best.pattern, best.name_count) == (pattern, len(set(names)))
    assert check_pattern(best.pattern) == pattern


def test_a_day_that_reads_two_ways_is_told() -> None:
    """03-04 may be March or April; once a name decides it, nothing is asked."""
    names = ["03-04-2026 10.11.12.jpg", "05-04-2026 10.11.12.jpg"]
    (unsure,) = propose(names, PRESENT)
    assert {unsure.pattern, unsure.swapped} == {"%d-%m-%Y %H.%M.%S", "%m-%d-%Y %H.%M.%S"}
    (sure,) = propose([*names, "31-03-2026 10.11.12.jpg"], PRESENT)
    assert (sure.pattern, sure.swapped) == ("%d-%m-%Y %H.%M.%S", None)


def test_a_year_of_two_digits_is_told_as_unsure() -> None:
    """03-04-26 may begin with its year: the reading nearest to the present is told with another."""
    (unsure,) = propose(["03-04-26 10.11.12.jpg"], PRESENT)
    assert (unsure.pattern, unsure.swapped) == ("%d-%m-%y %H.%M.%S", "%m-%d-%y %H.%M.%S")


def test_counters_behind_a_day_are_no_times() -> None:
    """What messengers number, and numbers beyond 59, are not proposed as hours and minutes."""
    assert propose(["IMG-20260701-WA0001.jpg", "IMG-20260701-WA0012.jpg"], PRESENT) == []
    assert propose([f"20260701_{number:04}.jpg" for number in range(100)], PRESENT) == []


def test_mixed_folders_get_a_pattern_for_each_sort_of_name() -> None:
    """Two recorders in one folder are two proposals; what only counts gets none."""
    names = [
        "20260701_101112.jpg",
        "20260701_101113.jpg",
        "2026-07-02 11.12.13.jpg",
        "DSC01234.jpg",
    ]
    assert [(found.pattern, found.name_count) for found in propose(names, PRESENT)] == [
        ("%Y%m%d_%H%M%S", 2),
        ("%Y-%m-%d %H.%M.%S", 1),
    ]


@given(st.lists(st.text(alphabet="0123456789-_.%TZ+ab ", max_size=40), max_size=5))
def test_any_names_are_read_without_harm(names: list[str]) -> None:
    """Whatever names there are, each proposal reads at least one of them, in the past."""
    for found in propose(names, PRESENT):
        assert found.name_count >= 1
        check_pattern(found.pattern)
