"""Matching by probability: right where pixels mislead, silent where no vessel explains a box."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.candidates import Candidate, candidate_or_reason
from app.domain.detection import Detection
from app.domain.fusion import FusionSettings, MatchingMethod, SeenImage, fuse_series
from app.domain.likelihood import LikelyPair, match_by_likelihood
from app.domain.seen_boxes import Scene
from app.domain.vessel_state import VesselState
from app.simulation.roadstead import FRAME, Anchored, Roadstead, RoadsteadSettings, make_roadstead

LIKELY = FusionSettings(matching=MatchingMethod.LIKELIHOOD)
# Exact AIS, but on water that is half a metre higher than thought.
CALM = RoadsteadSettings(position_sigma_m=2.0, heading_sigma_deg=1.0, water_level_sigma_m=0.5)


def candidates_of(stead: Roadstead, states: list[VesselState]) -> list[Candidate]:
    """Place the states before the camera, all of which can be seen."""
    placed = [
        candidate_or_reason(index, state, stead.camera, FRAME, 0.0, LIKELY)
        for index, state in enumerate(states)
    ]
    found = [one for one in placed if isinstance(one, Candidate)]
    assert len(found) == len(states)
    return found


def pairs_of(stead: Roadstead, ships: list[Anchored], detections: list[Detection]) -> set[int]:
    """Match an image that shows all ships; return the ships whose own detection was found."""
    states = [ship.state for ship in ships]
    pairs = match_by_likelihood(
        stead.camera, [Scene(detections, candidates_of(stead, states))], LIKELY
    )[0]
    assert all(pair.detection == pair.candidate for pair in pairs)
    return {pair.detection for pair in pairs}


def apart(ships: list[Anchored]) -> list[Anchored]:
    """Keep ships whose detections do not overlap those kept before: detectors see no more."""
    kept: list[Anchored] = []
    for ship in ships:
        a = ship.detection
        if all(a.x2_px < b.detection.x1_px or a.x1_px > b.detection.x2_px for b in kept):
            kept.append(ship)
    return kept


@pytest.mark.parametrize("seed", range(6))
def test_every_ship_of_a_roadstead_is_found(seed: int) -> None:
    """With fair AIS all ships get their own detections, whatever the water's height."""
    stead = make_roadstead(seed, CALM)
    ships = apart(stead.ships)
    assert pairs_of(stead, ships, [ship.detection for ship in ships]) == set(range(len(ships)))


@pytest.mark.parametrize("seed", range(6))
def test_a_silent_ships_detection_is_nobodys(seed: int) -> None:
    """Where the ship of a detection is not heard, no other ship takes it over."""
    stead = make_roadstead(seed, CALM)
    heard, *silent = apart(stead.ships)
    boxes = [one.detection for one in (heard, *silent)]
    assert pairs_of(stead, [heard], boxes) == {0}


def test_pixels_are_weighed_by_what_they_mean_in_metres() -> None:
    """A box 150 px beside a ship is believed at 200 m, where that is 5 m, and not at 900 m."""
    matched = []
    for nearest_m in (180.0, 880.0):
        around = replace(CALM, ships=1, nearest_m=nearest_m, farthest_m=nearest_m + 40)
        stead = make_roadstead(3, around)
        ship = stead.ships[0]
        box = ship.detection
        aside = replace(box, x1_px=box.x1_px + 150, x2_px=box.x2_px + 150)
        matched.append(pairs_of(stead, [ship], [aside]))
    assert matched == [{0}, set()]


@given(st.randoms(use_true_random=False), st.integers(0, 3))
@settings(max_examples=20, deadline=None)
def test_order_does_not_matter(random: object, seed: int) -> None:
    """Detections and vessels may come in any order: the same ships get the same detections."""
    stead = make_roadstead(seed, replace(CALM, ships=6))
    ships = list(stead.ships)
    boxes = [ship.detection for ship in ships]
    shuffle = getattr(random, "shuffle")  # noqa: B009 - Hypothesis types it as object
    shuffle(ships)
    shuffle(boxes)
    candidates = candidates_of(stead, [ship.state for ship in ships])
    pairs = match_by_likelihood(stead.camera, [Scene(boxes, candidates)], LIKELY)[0]
    matched = {(boxes[p.detection], candidates[p.candidate].state.identifier) for p in pairs}
    again = Scene(
        [s.detection for s in stead.ships], candidates_of(stead, [s.state for s in stead.ships])
    )
    expected = {
        (again.detections[p.detection], again.candidates[p.candidate].state.identifier)
        for p in match_by_likelihood(stead.camera, [again], LIKELY)[0]
    }
    assert matched == expected


def test_no_other_explanation_is_more_probable() -> None:
    """The pairs taken have the greatest sum of log odds among all that could be made."""
    stead = make_roadstead(11, replace(CALM, ships=4, position_sigma_m=25.0))
    candidates = candidates_of(stead, [ship.state for ship in stead.ships])
    boxes = [ship.detection for ship in stead.ships]

    def odds(row: int, column: int) -> float:
        pairs = match_by_likelihood(
            stead.camera, [Scene([boxes[row]], [candidates[column]])], FIXED
        )[0]
        return pairs[0].cost.log_odds if pairs else 0.0

    table = np.array([[odds(i, j) for j in range(4)] for i in range(4)])
    best = max(sum(table[i, j] for i, j in enumerate(p)) for p in permutations(range(4)))
    taken = match_by_likelihood(stead.camera, [Scene(boxes, candidates)], FIXED)[0]
    assert sum(pair.cost.log_odds for pair in taken) == pytest.approx(best, abs=1e-6)


# Water and camera known exactly: then pairs do not depend on each other.
FIXED = replace(LIKELY, level_sigma_m=1e-6, rotation_sigma_deg=1e-6)


def test_other_images_tell_the_waters_height() -> None:
    """Together the images of a while are more probable than each alone: they share their water."""
    stead = make_roadstead(5, replace(CALM, water_level_sigma_m=0.0))
    scenes = [Scene([ship.detection], [placed_at(stead, ship, 5.0)]) for ship in stead.ships]
    alone = [match_by_likelihood(stead.camera, [scene], LIKELY)[0] for scene in scenes]
    together = match_by_likelihood(stead.camera, scenes, LIKELY)
    assert odds_of(together) > odds_of(alone) + 1


def odds_of(images: list[list[LikelyPair]]) -> float:
    """Return the log odds of all pairs of some images."""
    return sum(pair.cost.log_odds for pairs in images for pair in pairs)


def placed_at(stead: Roadstead, ship: Anchored, level_m: float) -> Candidate:
    """Place a ship on water that is believed to be higher than it is."""
    placed = candidate_or_reason(0, ship.state, stead.camera, FRAME, level_m, LIKELY)
    assert isinstance(placed, Candidate)
    return placed


def first(pairs: list[list[LikelyPair]]) -> LikelyPair:
    """Return the pair of the first image."""
    return pairs[0][0]


def test_sure_pairs_say_so() -> None:
    """A pair that nothing rivals has a probability near 1, and its terms are plain numbers."""
    stead = make_roadstead(2, CALM)
    ship = stead.ships[0]
    scene = Scene([ship.detection], candidates_of(stead, [ship.state]))
    odds = first(match_by_likelihood(stead.camera, [scene], LIKELY)).cost
    assert 0.9 < odds.probability <= 1
    assert odds.total == -odds.log_odds < 0
    assert all(isinstance(value, float) for value in odds.terms().values())


@pytest.mark.parametrize(
    "method", [MatchingMethod.LIKELIHOOD, MatchingMethod.LU_2021, MatchingMethod.GROUND_PLANE]
)
def test_every_method_makes_poses_of_exact_ships(method: MatchingMethod) -> None:
    """With exact AIS and water nearly all ships get their poses; to some, a hull is no point."""
    exact = RoadsteadSettings(
        position_sigma_m=0.0, heading_sigma_deg=0.0, water_level_sigma_m=0.0, edge_sigma_px=0.0
    )
    stead = make_roadstead(4, exact)
    images = [SeenImage([s.detection], [s.state], 0.0, at) for at, s in enumerate(stead.ships)]
    results = fuse_series(stead.camera, FRAME, images, FusionSettings(matching=method))
    assert sum(len(result.poses) for result in results) >= 0.9 * len(images)


@pytest.mark.parametrize("method", list(MatchingMethod))
def test_no_method_matches_the_other_end_of_the_harbour(method: MatchingMethod) -> None:
    """A detection far from the only vessel stays unmatched, and the vessel says why."""
    stead = make_roadstead(4, replace(CALM, ships=1, farthest_m=260.0))
    ship = stead.ships[0]
    far = Detection(2300.0, 700.0, 2330.0, 712.0, 0.9)
    image = SeenImage([far], [ship.state], 0.0)
    result = fuse_series(
        stead.camera, FRAME, [image], FusionSettings(matching=method, maximum_cost=0.2)
    )[0]
    assert (result.poses, result.unmatched_detections) == ([], [0])
    assert result.unmatched_states[0] in {"cost_too_high", "no_detection_left"}


@pytest.mark.parametrize("method", list(MatchingMethod))
def test_nothing_and_nobody_is_no_error(method: MatchingMethod) -> None:
    """Images without detections or without vessels have no pairs."""
    stead = make_roadstead(4, replace(CALM, ships=1))
    ship = stead.ships[0]
    images = [SeenImage([], [ship.state], 0.0), SeenImage([ship.detection], [], 0.0)]
    results = fuse_series(stead.camera, FRAME, images, FusionSettings(matching=method))
    assert [result.poses for result in results] == [[], []]
