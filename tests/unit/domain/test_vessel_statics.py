"""The latest of each static field."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.ais import StaticReport
from app.domain.vessel_statics import Hull, KnownHull, hull_at, hull_of, statics_at

NOON = datetime(2024, 5, 1, 12, 0, tzinfo=UTC)
NOTHING = StaticReport(211_000_001, NOON, None, None, None, None, None, None, None, None)


def said(minutes: float, **fields: object) -> StaticReport:
    """Return a report some minutes after noon that says only these fields."""
    report = replace(NOTHING, received_at=NOON + timedelta(minutes=minutes))
    return replace(report, **fields)  # type: ignore[arg-type]


def sized(to_bow: float, to_stern: float, to_port: float, to_starboard: float) -> dict[str, object]:
    """Return the four distances as fields."""
    return {
        "to_bow_m": to_bow,
        "to_stern_m": to_stern,
        "to_port_m": to_port,
        "to_starboard_m": to_starboard,
    }


def test_each_field_is_the_latest_said_before() -> None:
    """Name and size come from different messages, each its latest, in any order of input."""
    statics = statics_at(
        [
            said(-1, callsign="DABC"),
            said(-5, name="OLD", ship_type=70),
            said(-2, name="NEW"),
            said(1, name="FUTURE"),
            said(-3, **sized(8, 11, 4, 3)),
        ],
        NOON,
    )
    assert (statics.name, statics.callsign, statics.ship_type) == ("NEW", "DABC", 70)
    assert statics.hull == Hull(8, 11, 4, 3)
    assert not statics.is_later


def test_what_was_said_only_later_is_used_and_marked() -> None:
    """A size that came after the image is better than none, and the state says so."""
    statics = statics_at([said(-1, name="A"), said(6, **sized(8, 11, 4, 3))], NOON)
    assert statics.hull == Hull(8, 11, 4, 3)
    assert statics.is_later


@pytest.mark.parametrize(
    ("distances", "hull"),
    [
        ((8, 11, 4, 3), Hull(8, 11, 4, 3)),
        ((0, 30, 4, 4), Hull(0, 30, 4, 4)),  # an antenna on the bow
        ((30, 20, 0, 8), Hull(30, 20, 0, 8)),  # or on the port side
        ((0, 30, 0, 8), Hull(15, 15, 4, 4, is_centred=True)),
        ((511, 30, 63, 8), Hull(511, 30, 63, 8, is_at_least=True)),
        ((0, 0, 4, 4), None),
        ((30, 20, 0, 0), None),
    ],
)
def test_hulls(distances: tuple[float, float, float, float], hull: Hull | None) -> None:
    """An unknown antenna is put amidships; a box without length or width is none."""
    assert hull_of(said(0, **sized(*distances))) == hull


def test_the_hull_is_the_latest_said_before() -> None:
    """A hull comes with the moment it was said; one said only afterwards says so."""
    small, large = Hull(8, 11, 4, 3), Hull(30, 40, 6, 6)
    reports = [
        said(5, **sized(30, 40, 6, 6)),
        said(-9, **sized(30, 40, 6, 6)),
        said(-3, **sized(8, 11, 4, 3)),
        said(-1, name="NO SIZE"),
    ]
    assert hull_at(reports, NOON) == KnownHull(small, NOON - timedelta(minutes=3), is_later=False)
    assert hull_at(reports[:1], NOON) == KnownHull(
        large, NOON + timedelta(minutes=5), is_later=True
    )
    assert hull_at(reports[3:], NOON) is None
