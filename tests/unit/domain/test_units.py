"""Units of several boxes: a tug with its barges has one AIS, and parts take nobody else's."""

from dataclasses import replace

from app.domain.candidates import Candidate, candidate_or_reason
from app.domain.detection import Detection
from app.domain.fusion import FusionSettings, MatchingMethod
from app.domain.likelihood import match_by_likelihood
from app.domain.seen_boxes import Scene
from app.domain.units import edges_of, parts_of, rows_of_hulls, side_by_side
from app.simulation.roadstead import FRAME, RoadsteadSettings, make_roadstead

LIKELY = FusionSettings(matching=MatchingMethod.LIKELIHOOD)
ALONE = RoadsteadSettings(position_sigma_m=1.0, heading_sigma_deg=1.0, ships=1)


def split(box: Detection, share: float) -> tuple[Detection, Detection]:
    """Return the left and the right hull of a unit."""
    middle = box.x1_px + share * (box.x2_px - box.x1_px)
    return replace(box, x2_px=middle - 1), replace(box, x1_px=middle + 1)


def units_of(boxes: list[Detection]) -> list[tuple[int, ...]]:
    """Return which boxes of an image may be one unit."""
    return [hulls for _, hulls in rows_of_hulls(boxes, side_by_side(edges_of(boxes)))]


def test_hulls_of_one_unit_are_matched_together() -> None:
    """Two boxes in a line that are as long together as AIS says are one vessel, told by both."""
    stead = make_roadstead(3, ALONE)
    ship = stead.ships[0]
    placed = candidate_or_reason(0, ship.state, stead.camera, FRAME, 0.0, LIKELY)
    assert isinstance(placed, Candidate)
    hulls = split(ship.detection, 0.3)
    (pair,) = match_by_likelihood(stead.camera, [Scene(hulls, [placed])], LIKELY)[0]
    (antenna,) = stead.camera.project(placed.segment.antenna_in_world[None])
    assert (pair.box.x1_px, pair.box.x2_px) == (ship.detection.x1_px, ship.detection.x2_px)
    assert pair.detection == int(antenna[0] > hulls[0].x2_px)


def test_a_part_takes_no_other_vessel() -> None:
    """A box within a matched one, on its waterline, is a part of it and shows no other vessel."""
    stead = make_roadstead(3, ALONE)
    ship = stead.ships[0]
    _, part = split(ship.detection, 0.55)
    other = replace(ship.state, identifier="other", to_bow_m=9.0, to_stern_m=9.0)
    candidates = [
        candidate_or_reason(i, state, stead.camera, FRAME, 0.0, LIKELY)
        for i, state in enumerate((ship.state, other))
    ]
    scene = Scene([ship.detection, part], [c for c in candidates if isinstance(c, Candidate)])
    pairs = match_by_likelihood(stead.camera, [scene], LIKELY)[0]
    assert [(pair.detection, pair.candidate) for pair in pairs] == [(0, 0)]


def test_a_boat_in_front_of_a_ship_is_no_part() -> None:
    """What lies lower in the image than the ship's waterline is a vessel of its own."""
    ship = Detection(100, 100, 500, 200, 0.9)
    boat = Detection(200, 175, 240, 230, 0.9)
    house = Detection(200, 120, 300, 198, 0.9)
    parts = parts_of(edges_of([ship, boat, house]))
    assert parts.tolist() == [[False] * 3, [False] * 3, [True, False, False]]


def test_hulls_of_a_unit_lie_on_one_line() -> None:
    """Boxes side by side make a unit, and no more where one lies farther away than the other."""
    left, right = split(Detection(100, 100, 500, 200, 0.9), 0.5)
    away = replace(right, y1_px=20, y2_px=120)
    assert units_of([right, left]) == [(1, 0)]
    assert not units_of([left, away])
