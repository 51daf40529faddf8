"""The pictures of the documentation, made anew where QUAYMARK_UPDATE_SCREENSHOTS is set."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page

from tests.browser.conftest import UPDATE_SCREENSHOTS, MakeRun
from tests.browser.review_page import ReviewPage
from tests.worker_process import ROOT

TARGET = ROOT / "docs" / "screenshot-review.png"


@pytest.mark.skipif(not UPDATE_SCREENSHOTS, reason="only where QUAYMARK_UPDATE_SCREENSHOTS is set")
def test_the_review_is_pictured(
    page: Page, make_run: MakeRun, poses_of: Callable[[int], list[dict[str, Any]]]
) -> None:
    """The review in work, at the vessel that fills most of its photograph, goes to docs."""
    run_id = make_run("Demo, View 1")
    poses = poses_of(run_id)

    def area_px(pose: dict[str, Any]) -> float:
        box = pose["detection"]
        is_cut = pose["flags"] or not all(pose["corners_in_image_px"])
        size = (box["x2_px"] - box["x1_px"]) * (box["y2_px"] - box["y1_px"])
        return 0.0 if is_cut else float(size)

    ids = [pose["id"] for pose in poses]
    shown = max(poses, key=area_px)["id"]
    review = ReviewPage(page)
    review.open(run_id)
    for key in "1121211":
        if review.pose_id == shown:
            review.press("j")
        review.press(key)
    way = ids.index(shown) - ids.index(review.pose_id)
    review.press(*["j" if way > 0 else "k"] * abs(way))
    review.wait_for_photograph()
    review.expect_all_saved()
    TARGET.parent.mkdir(exist_ok=True)
    page.screenshot(path=TARGET)
    assert TARGET.stat().st_size > 10_000
