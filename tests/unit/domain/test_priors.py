"""Chances learnt from graded images: near the truth, and judged where they were not fitted."""

from dataclasses import replace

import numpy as np
import pytest

from app.domain.prior_gain import held_out_gain, missing, occasions, silent_share
from app.domain.priors import (
    CERTAINTY,
    GradedBox,
    GradedImage,
    GradedPair,
    Priors,
    fit_priors,
    logit,
)


def harbour(
    seed: int,
    images: int = 80,
    *,
    unidentified: float = 3.0,
    detected: float = 0.6,
    slope: float = 1.5,
    published: bool = False,
) -> list[GradedImage]:
    """Draw graded images of a harbour whose chances are known, eight an occasion."""
    rng = np.random.default_rng(seed)
    used = Priors()
    drawn = []
    for number in range(images):
        boxes, pairs = [], []
        vessels = rng.integers(0, 6)
        found = int(rng.binomial(vessels, detected))
        for _ in range(found + int(rng.poisson(unidentified))):
            vessel = len(boxes) < found
            score = float(1 / (1 + np.exp(-rng.normal(slope / 2 if vessel else -slope / 2, 1))))
            mmsi = 211_000_000 + 10 * number + len(boxes)
            boxes.append(GradedBox(score, mmsi if vessel else None))
            if published:
                cost = float(rng.gamma(2, 0.05 if vessel else 0.3))
                pairs.append(GradedPair(score, mmsi, cost, None, vessel))
                continue
            # Log ratios that are worth half of what they say, as those of edges are.
            ratio = float(rng.normal(2 if vessel else -2, 2)) / CERTAINTY
            odds = ratio + used.log_odds(score)
            if odds > 0:
                said = 1 / (1 + np.exp(-CERTAINTY * odds))
                pairs.append(GradedPair(score, mmsi, -odds, said, vessel))
        drawn.append(
            GradedImage(
                id=number,
                at_s=7200.0 * (number // 8) + 60.0 * number,
                used=used,
                boxes=boxes,
                pairs=pairs,
                not_detected=int(vessels) - found,
                silent=0,
                visible=int(vessels),
            )
        )
    return drawn


def test_fitted_chances_are_near_the_true_ones() -> None:
    """From many graded images the injected shares and the detector's slope come out."""
    fitted = fit_priors(harbour(1, 400))
    assert fitted.unidentified_per_image == pytest.approx(3.0, rel=0.08)
    assert fitted.detected_share == pytest.approx(0.6, abs=0.04)
    assert fitted.score_weight == pytest.approx(1.5, rel=0.2)
    assert fitted.score_center == pytest.approx(0.0, abs=0.2)


def test_few_images_change_little() -> None:
    """Without images the usual chances stand; scores of a handful of boxes tell nothing."""
    assert fit_priors([]) == Priors()
    few = fit_priors(harbour(2, 3))
    assert few.score_weight == 0
    assert 0.8 < few.unidentified_per_image < 2.2


def test_scores_that_speak_against_vessels_are_not_believed() -> None:
    """A detector whose low scores are vessels is a slip of the data: scores then do not count."""
    assert fit_priors(harbour(3, 100, slope=-1.5)).score_weight == 0


def test_what_is_learnt_helps_on_occasions_left_out() -> None:
    """Where a harbour differs from the usual, held-out probabilities get better, surely."""
    gain = held_out_gain(harbour(4, 160))
    assert gain.loss_change is not None
    change, low, high = gain.loss_change
    assert low <= change <= high < 0
    assert gain.fitted.wrong < gain.now.wrong


def test_where_nothing_differs_nothing_is_claimed() -> None:
    """In a harbour that is as usual fitted chances are worth next to nothing."""
    usual = harbour(5, 80, unidentified=1.0, detected=0.8, slope=0.0)
    gain = held_out_gain(usual)
    assert gain.loss_change is not None
    assert abs(gain.loss_change[0]) < 0.03


def test_a_limit_of_the_published_cost_is_learnt() -> None:
    """Between the costs of right and wrong pairs the limit with the fewest errors is found."""
    images = harbour(6, 120, published=True)
    gain = held_out_gain(images)
    assert 0.1 < (fit_priors(images).maximum_cost or 0) < 0.4
    assert gain.loss_change is None
    assert gain.is_better
    assert gain.now.wrong - gain.fitted.wrong > gain.now.right - gain.fitted.right


def test_vessels_seen_on_an_occasion_do_not_teach_for_it() -> None:
    """A fit without a vessel is the same whatever that vessel's boxes were."""
    images = harbour(7, 40)
    known = images[0].boxes[0].mmsi or images[0].pairs[0].mmsi
    loud = [replace(i, boxes=[*i.boxes, *[GradedBox(0.9, known)] * 20]) for i in images]
    without = frozenset({known})
    assert fit_priors(loud, without) == fit_priors(images, without)
    assert fit_priors(loud) != fit_priors(images)


def test_too_few_grades_say_how_many_more() -> None:
    """Images, occasions and right matches are asked for until there are enough of each."""
    assert not missing(harbour(8, 80)).anything
    lacking = missing(harbour(8, 10))
    assert (lacking.images, lacking.occasions) == (20, 2)
    assert lacking.right > 0
    assert len(occasions(harbour(8, 17))) == 3
    assert silent_share([]).of == 0


def test_scores_of_one_and_zero_have_odds() -> None:
    """A detector that is quite sure does not make odds endless."""
    assert logit(1.0) == pytest.approx(-logit(0.0)) == pytest.approx(4.595, abs=1e-3)
