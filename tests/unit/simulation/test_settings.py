"""Settings that make no sense are refused by name."""

import pytest

from app.simulation.harbour import make_harbour
from app.simulation.settings import DetectorSettings, HarbourSettings, TrafficSettings
from app.simulation.ship_plans import Fleet


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: TrafficSettings(no_ais_share=1.5), "no_ais_share"),
        (lambda: TrafficSettings(bias_sigma_m=-1.0), "bias_sigma_m"),
        (lambda: TrafficSettings(delay_median_s=float("nan")), "delay_median_s"),
        (lambda: TrafficSettings(spacing_s=0.0), "spacing_s"),
        (lambda: DetectorSettings(miss_share=-0.1), "miss_share"),
        (lambda: HarbourSettings(tide_amplitude_m=-2.0), "tide_amplitude_m"),
        (lambda: HarbourSettings(images_per_session=0), "images_per_session"),
    ],
)
def test_amounts_out_of_range_are_refused(make: object, field: str) -> None:
    """The error names the field."""
    assert callable(make)
    with pytest.raises(ValueError, match=field):
        make()


def test_the_judging_fleet_sails_when_asked_for() -> None:
    """The same seed with the other fleet has the same kinds of ships with other hulls."""
    usual, judging = (
        make_harbour(3, 1, 160, 120, settings=HarbourSettings(fleet=fleet)) for fleet in Fleet
    )
    first, second = usual.vessels[0].ship, judging.vessels[0].ship
    assert first.ship_type == second.ship_type
    assert first.mesh.vertices.shape != second.mesh.vertices.shape or bool(
        (first.mesh.vertices != second.mesh.vertices).any()
    )


def test_ais_can_be_switched_off_for_all() -> None:
    """With every vessel mute there is no recording, and truth carries no MMSI."""
    mute = TrafficSettings(no_ais_share=1.0, moored_with_ais_share=0.0)
    harbour = make_harbour(3, 2, 160, 120, settings=HarbourSettings(traffic=mute))
    assert harbour.nmea_text() == ""
    assert all(truth.mmsi is None for frame in harbour.frames for truth in frame.truth)
