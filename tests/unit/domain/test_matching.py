"""Matching takes the cheapest assignment as a whole and knows its border cases."""

from collections.abc import Callable
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.borders import CutEdges, cut_edges
from app.domain.camera import Camera, Intrinsics
from app.domain.candidates import Candidate, UnmatchedReason, candidate_or_reason
from app.domain.detection import Detection
from app.domain.fusion_settings import FusionSettings
from app.domain.geodesy import EcefFrame, EnuFrame
from app.domain.matching import match, matching_cost
from app.domain.vessel_state import VesselState
from app.domain.waterplane import water_plane_segment

State = Callable[..., VesselState]
IMAGE = Intrinsics(1000, 500, np.array([[900.0, 0, 500], [0, 900, 250], [0, 0, 1]]))
SETTINGS = FusionSettings()
SIZED = VesselState("sized", 53.5, 10, 0, 0, 0, 10, 10, 2, 2)
UNSIZED = VesselState("unsized", 53.5, 10, 0, 0, 0, 0, 0, 0, 0)


def candidate(rectangle: list[float], state: VesselState = SIZED) -> Candidate:
    """Give a vessel whose WP_ais is known."""
    segment = water_plane_segment(EcefFrame(), 0.0, state)
    return Candidate(0, state, segment, np.array(rectangle))


def test_cost_follows_the_papers_formula() -> None:
    """Theta is (2 dcx + dbottom + dwidth) / score with shares of width and height."""
    cost = matching_cost(
        Detection(100, 100, 200, 200, 0.5), candidate([150, 0, 290, 230]), IMAGE, 2
    )
    assert (cost.center_x, cost.bottom, cost.width) == pytest.approx((0.07, 0.06, 0.04))
    assert cost.total == pytest.approx((2 * 0.07 + 0.06 + 0.04) / 0.5)
    assert set(cost.terms()) == {"center_x", "bottom", "width", "score"}


@pytest.mark.parametrize(
    ("box", "state"),
    [
        (Detection(1.5, 100, 200, 200, 1.0), SIZED),
        (Detection(800, 100, 998, 200, 1.0), SIZED),
        (Detection(-4, 100, 1004, 200, 1.0), SIZED),
        (Detection(100, 100, 200, 200, 1.0), UNSIZED),
    ],
)
def test_widths_are_not_compared_where_they_mean_nothing(
    box: Detection, state: VesselState
) -> None:
    """A detection cut sideways, or a vessel of unknown size, is matched without the width."""
    cost = matching_cost(box, candidate([150, 0, 290, 230], state), IMAGE, 2)
    assert cost.width is None
    assert cost.total == pytest.approx(2 * cost.center_x + cost.bottom)


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        ((2, 50, 500, 100), CutEdges(left=True, right=False, top=False, bottom=False)),
        ((2.1, 50, 996.9, 496.9), CutEdges(left=False, right=False, top=False, bottom=False)),
        ((50, 2, 997, 100), CutEdges(left=False, right=True, top=True, bottom=False)),
        ((50, 50, 500, 500), CutEdges(left=False, right=False, top=False, bottom=True)),
    ],
)
def test_border_tolerance_is_two_pixels(
    box: tuple[float, float, float, float], expected: CutEdges
) -> None:
    """Two pixels from the outermost pixel still touch the border, more do not."""
    assert cut_edges(Detection(*box, 1.0), IMAGE, 2.0) == expected


def test_the_cheapest_whole_beats_the_cheapest_pair() -> None:
    """A vessel gives its best detection away when the sum gets smaller."""
    boxes = [Detection(100, 100, 200, 200, 1.0), Detection(160, 100, 260, 200, 1.0)]
    vessels = [candidate([150, 150, 250, 200]), candidate([400, 150, 500, 200])]
    # The first vessel is nearest to the second box, but so is the second vessel, which has no
    # other choice; the greedy choice would cost more in all.
    pairs = match(boxes, vessels, IMAGE, SETTINGS)
    assert [(p.detection, p.candidate) for p in pairs] == [(0, 0), (1, 1)]


@given(
    st.lists(st.tuples(st.floats(5, 900), st.floats(0.3, 1)), min_size=1, max_size=4),
    st.lists(st.floats(5, 900), min_size=1, max_size=4),
)
def test_no_other_assignment_is_cheaper(
    boxes: list[tuple[float, float]], vessels: list[float]
) -> None:
    """Against every possible assignment, the one taken is minimal and pairs as many as it can."""
    detections = [Detection(x, 100, x + 50, 200, score) for x, score in boxes]
    candidates = [candidate([x, 150, x + 60, 210]) for x in vessels]
    pairs = match(detections, candidates, IMAGE, SETTINGS)
    assert len(pairs) == min(len(detections), len(candidates))
    table = np.array(
        [[matching_cost(d, c, IMAGE, 2).total for c in candidates] for d in detections]
    )
    if len(detections) > len(candidates):
        table = table.T
    rows = range(len(table))
    cheapest = min(
        sum(table[r, c] for r, c in zip(rows, columns, strict=True))
        for columns in permutations(range(table.shape[1]), len(table))
    )
    assert sum(p.cost.total for p in pairs) == pytest.approx(cheapest)


def test_empty_sides_match_nothing() -> None:
    """No detections or no vessels give no pairs, and neither does a score below the threshold."""
    box, vessel = Detection(100, 100, 200, 200, 1.0), candidate([150, 150, 250, 200])
    assert match([], [vessel], IMAGE, SETTINGS) == []
    assert match([box], [], IMAGE, SETTINGS) == []
    assert match([Detection(100, 100, 200, 200, 0.24)], [vessel], IMAGE, SETTINGS) == []


def test_a_score_of_zero_is_the_last_choice() -> None:
    """With the threshold at 0, a detection of score 0 costs infinitely much but breaks nothing."""
    boxes = [Detection(100, 100, 200, 200, 0.0), Detection(700, 100, 800, 200, 0.9)]
    settings = FusionSettings(score_threshold=0)
    (pair,) = match(boxes, [candidate([100, 150, 200, 200])], IMAGE, settings)
    assert pair.detection == 1


@pytest.mark.parametrize(
    ("east", "north", "changes", "reason"),
    [
        (0, 300, {"lat_deg": 91.0}, UnmatchedReason.NO_POSITION),
        (0, 300, {"lon_deg": float("nan")}, UnmatchedReason.NO_POSITION),
        (0, 300, {"heading_deg": float("nan")}, UnmatchedReason.NO_HEADING),
        (0, 300, {"age_s": 60.5}, UnmatchedReason.REPORT_TOO_OLD),
        (0, 3100, {}, UnmatchedReason.OUT_OF_RANGE),
        (0, -300, {}, UnmatchedReason.BEHIND_CAMERA),
        (100, 2, {}, UnmatchedReason.BEHIND_CAMERA),
        (250, 300, {}, UnmatchedReason.OUTSIDE_IMAGE),
        (-250, 300, {}, UnmatchedReason.OUTSIDE_IMAGE),
    ],
)
def test_vessels_that_cannot_be_in_the_picture_are_refused(
    camera: Camera,
    frame: EnuFrame,
    vessel: State,
    east: float,
    north: float,
    changes: dict[str, object],
    reason: UnmatchedReason,
) -> None:
    """Each impossible vessel is refused with its own reason."""
    state = vessel(east, north, **changes)
    assert candidate_or_reason(0, state, camera, frame, 0.0, SETTINGS) == reason


@pytest.mark.parametrize(("east", "north"), [(0, 300), (180, 300), (-180, 300), (0, 2900)])
def test_vessels_in_or_beside_the_picture_are_candidates(
    camera: Camera, frame: EnuFrame, vessel: State, east: float, north: float
) -> None:
    """Half an image's width beside the picture a vessel may still be meant; its rectangle shows."""
    placed = candidate_or_reason(7, vessel(east, north), camera, frame, 0.0, SETTINGS)
    assert isinstance(placed, Candidate)
    assert placed.state_index == 7
    # 30 m by 8 m of hull heading east, seen with a focal length of 4000 px.
    corners = [(east + x) / (north + y) for x in (-15, 15) for y in (-4, 4)]
    expected = [1280 + 4000 * min(corners), 1280 + 4000 * max(corners)]
    assert placed.rectangle_px[[0, 2]] == pytest.approx(expected, abs=1)


@pytest.mark.parametrize(
    ("field", "value"),
    [("maximum_cost", -1.0), ("score_threshold", 1.5), ("nms_iou", float("nan"))],
)
def test_settings_out_of_range_are_refused(field: str, value: float) -> None:
    """A setting that makes no sense is refused by its name."""
    with pytest.raises(ValueError, match=field):
        FusionSettings(**{field: value})  # type: ignore[arg-type]  # one float field at a time
