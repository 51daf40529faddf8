"""The harbour as a whole: the same every time, complete, and within its word."""

import pickle
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from app.simulation.detections import coco_results
from app.simulation.harbour import Harbour, make_harbour


def test_the_same_seed_gives_the_same_harbour() -> None:
    """Pixels, AIS text, keypoints and detections repeat exactly."""
    one, two = (make_harbour(5, image_count=2, width_px=160, height_px=120) for _ in range(2))
    assert one.nmea_text() == two.nmea_text()
    assert one.camera.viewports[0].keypoints == two.camera.viewports[0].keypoints
    assert [f.detections for f in one.frames] == [f.detections for f in two.frames]
    for a, b in zip(one.frames, two.frames, strict=True):
        assert np.array_equal(a.render(), b.render())


def test_an_image_does_not_depend_on_those_before_it(harbour: Harbour) -> None:
    """Frames can be rendered in any order and in any process."""
    again = make_harbour(7, image_count=18, width_px=320, height_px=240)
    assert np.array_equal(harbour.frames[3].render(), again.frames[3].observe().image)
    copied = pickle.loads(pickle.dumps(again))  # noqa: S301 - our own bytes
    assert np.array_equal(copied.frames[9].render(), again.frames[9].render())


def test_images_of_a_session_may_be_rendered_in_any_order() -> None:
    """What a session's images share is the same whichever of them came first."""
    one, two = (make_harbour(11, image_count=3, width_px=320, height_px=240) for _ in range(2))
    forwards = [frame.render() for frame in one.frames]
    backwards = [frame.render() for frame in reversed(two.frames)][::-1]
    assert one.frames[0].water_level_m != one.frames[2].water_level_m
    for a, b in zip(forwards, backwards, strict=True):
        assert np.array_equal(a, b)


def test_another_seed_gives_another_harbour(harbour: Harbour) -> None:
    """Nothing important is constant."""
    other = make_harbour(8, image_count=2, width_px=320, height_px=240)
    assert other.site.origin != harbour.site.origin
    assert other.nmea_text() != harbour.nmea_text()


def test_images_have_the_size_type_and_light_of_a_photograph(harbour: Harbour) -> None:
    """Eight bits, BGR, neither black nor burnt out, sky brighter than water."""
    image = harbour.frames[0].render()
    assert image.shape == (240, 320, 3)
    assert image.dtype == np.uint8
    assert 60 < image.mean() < 215
    assert image[:20].mean() > image[-60:].mean()


def test_frames_are_in_order_and_in_their_viewport(harbour: Harbour) -> None:
    """Times rise, are aware UTC, and lie within the validity of the frame's viewport."""
    times = [frame.captured_at for frame in harbour.frames]
    assert times == sorted(times)
    assert len(harbour.frames) == 18
    for frame in harbour.frames:
        assert frame.captured_at.utcoffset() == timedelta(0)
        assert frame.viewport.valid_from <= frame.captured_at
        assert frame.viewport.valid_until is None or frame.captured_at < frame.viewport.valid_until
    assert {frame.viewport.name for frame in harbour.frames} == {"View 1", "View 2"}


def test_keypoints_are_many_spread_and_a_pixel_off(harbour: Harbour) -> None:
    """At least 12 a viewport, near and far, not in line, about a pixel from the truth."""
    places = {landmark.name: landmark.place for landmark in harbour.landmarks}
    for viewport in harbour.camera.viewports:
        assert len(viewport.keypoints) >= 12
        points = np.array(
            [harbour.frame.position(p.lat_deg, p.lon_deg, p.height_m)
             for p in (places[k.landmark] for k in viewport.keypoints)]
        )  # fmt: skip
        clicked = np.array([(k.u_px, k.v_px) for k in viewport.keypoints])
        off = np.hypot(*(viewport.camera.project(points) - clicked).T)
        assert 0.3 < np.median(off) < 2.5
        distance = np.linalg.norm(points - viewport.camera.center_in_world, axis=1)
        assert distance.min() < 160
        assert distance.max() > 600
        assert np.linalg.svd(clicked - clicked.mean(axis=0))[1][1] > 50


def test_viewports_differ_by_degrees(harbour: Harbour) -> None:
    """The camera was turned between the sessions, and stayed where it was."""
    first, second = (v.camera for v in harbour.camera.viewports)
    turn = first.R_cam_from_world @ second.R_cam_from_world.T
    angle = np.degrees(np.arccos((np.trace(turn) - 1) / 2))
    assert 1.0 < angle < 8.0
    assert np.array_equal(first.center_in_world, second.center_in_world)


def test_perfect_detections_are_the_silhouettes(perfect_harbour: Harbour) -> None:
    """Without errors each visible whole vessel has its exact box."""
    for frame in perfect_harbour.frames:
        boxes = sorted(t.box_px for t in frame.truth if t.box_px and t.part_of is None)
        found = sorted((d.x1_px, d.y1_px, d.x2_px, d.y2_px) for d in frame.detections)
        wide = [b for b in boxes if b[2] - b[0] > 1 and b[3] - b[1] > 1]
        assert found == wide


def test_coco_results_name_image_category_box_and_score(harbour: Harbour) -> None:
    """The list is what COCO tools read: x, y, width, height, within the image."""
    results = coco_results((frame.image_id, frame.detections) for frame in harbour.frames)
    assert {r["image_id"] for r in results} <= {f.image_id for f in harbour.frames}
    for result in results:
        assert result["category_id"] == 9
        assert isinstance(result["bbox"], list)
        x, y, w, h = result["bbox"]
        assert x >= 0
        assert y >= 0
        assert x + w <= 320 + 1e-9
        assert y + h <= 240 + 1e-9
        assert 0 < float(str(result["score"])) < 1


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"image_count": 0}, "image_count"),
        ({"width_px": 0}, "width_px"),
        ({"seed": -1}, "seed"),
        ({"start": datetime(2026, 5, 1)}, "start"),  # noqa: DTZ001 - the error under test
        ({"start": datetime(2026, 5, 1, tzinfo=timezone(timedelta(hours=2)))}, "start"),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, object], field: str) -> None:
    """The error says which argument is wrong."""
    usual: dict[str, object] = {"seed": 1, "start": datetime(2026, 5, 1, tzinfo=UTC)}
    with pytest.raises(ValueError, match=field):
        make_harbour(**(usual | arguments))  # type: ignore[arg-type]
