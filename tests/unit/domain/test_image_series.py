"""Series of images: vessels are followed through them, and all boxes of a track have a say."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.image_series import SeriesTrack, split_series
from app.domain.image_tracks import image_tracks
from app.domain.pairing import match_images
from app.domain.sighting import SeenImage
from app.domain.track_votes import Voices, assign_tracks, vote
from app.domain.vessel_state import VesselState
from app.simulation.roadstead import FRAME, RoadsteadSettings, make_roadstead


def test_boxes_that_pass_each_other_stay_apart() -> None:
    """Two vessels on opposite courses keep their tracks where their boxes meet."""
    images = []
    for step in range(9):
        east = Detection(100 + 40 * step, 300, 220 + 40 * step, 340, 0.9)
        west = Detection(500 - 40 * step, 310, 560 - 40 * step, 380, 0.9)
        images.append([(0, east), (1, west)] if step % 2 else [(1, west), (0, east)])
    tracks = image_tracks([3.0 * step for step in range(9)], images)
    assert sorted(tracks) == [[(i, box) for i in range(9)] for box in (0, 1)]


def test_a_vessel_overlooked_once_keeps_its_track() -> None:
    """One image without a vessel's box does not end its track; many do."""
    box = Detection(100, 300, 220, 340, 0.9)
    seen = [0, 1, 3, 4, 11]
    images = [[(0, box)] if step in seen else [] for step in range(12)]
    tracks = image_tracks([3.0 * step for step in range(12)], images)
    assert tracks == [[(i, 0) for i in (0, 1, 3, 4)], [(11, 0)]]


@given(st.lists(st.floats(0, 100), max_size=30), st.floats(0, 40))
def test_series_are_images_close_in_time(gaps_s: list[float], gap_s: float) -> None:
    """A series has two images or more; within it no gap is too long, around it each is."""
    times = np.cumsum([0.0, *gaps_s])
    series = split_series(times.tolist(), gap_s)
    inside = {i for images in series for i in list(images)[:-1]}
    assert inside == {i for i in range(len(times) - 1) if times[i + 1] - times[i] <= gap_s}


def test_most_boxes_of_a_track_outvote_the_others() -> None:
    """A track is its vessel's also in the image that speaks against it, but not a stranger's."""
    track = SeriesTrack(rows=[0, 1, 2, 3], images=[0, 1, 2, 3])
    row = np.array([0, 1, 2, 3, 2])
    vessel = np.array([0, 0, 0, 0, 1])
    worth = np.array([5.0, 6.0, -1.0, -30.0, 4.0])
    voted, allowed = vote(Voices(row, vessel, worth), [track])
    assert voted[0] == voted[2] == pytest.approx(2.0)
    assert allowed.tolist() == [True, True, True, False, False]


def test_pieces_of_a_track_may_be_one_vessels() -> None:
    """Tracks no image shows together may have the same vessel, others not; the best comes first."""
    worth = np.array([[3.0], [5.0], [2.0]])
    together = np.array([[True, True, False], [True, True, False], [False, False, True]])
    assert assign_tracks(worth, together).tolist() == [-1, 0, 0]


@pytest.mark.parametrize(
    "method", [MatchingMethod.TRACK_VOTES, MatchingMethod.HUANG_2021, MatchingMethod.QU_2022]
)
def test_tracks_of_a_roadstead_find_their_vessels(method: MatchingMethod) -> None:
    """Every way that follows vessels finds lone ones in a series, and alone in an image."""
    stead = make_roadstead(
        1, RoadsteadSettings(ships=1, position_sigma_m=2.0, heading_sigma_deg=1.0)
    )
    ship = stead.ships[0]
    images = [SeenImage([ship.detection], [ship.state], 0.0, at_s) for at_s in (0.0, 3.0, 6.0, 99)]
    settings = FusionSettings(matching=method)
    matched = match_images(stead.camera, FRAME, images, settings)
    assert [len(image.pairs) for image in matched] == [1, 1, 1, 1]
    empty = match_images(stead.camera, FRAME, [SeenImage([], [ship.state], 0.0)] * 2, settings)
    assert [image.pairs for image in empty] == [[], []]


def test_a_vessel_that_arrives_at_another_time_is_another() -> None:
    """Matching by arrival takes no vessel that was at the place a minute before."""
    stead = make_roadstead(
        1, RoadsteadSettings(ships=1, position_sigma_m=0.0, heading_sigma_deg=0.0)
    )
    ship = stead.ships[0]

    def pairs(state: VesselState) -> int:
        image = SeenImage([ship.detection], [state], 0.0)
        settings = FusionSettings(matching=MatchingMethod.QU_2022)
        return len(match_images(stead.camera, FRAME, [image], settings)[0].pairs)

    passing = replace(ship.state, speed_kn=8.0, age_s=0.0)
    assert pairs(passing) == 1
    assert pairs(replace(passing, age_s=40.0)) == 0
