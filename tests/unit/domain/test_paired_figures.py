"""Differences of two runs over the same images, against draws done the long way."""

import numpy as np
import pytest

from app.domain.paired_figures import (
    Values,
    drawn_images,
    paired_median,
    paired_ratio,
    sums_by_image,
)


def test_medians_of_draws_are_those_of_repeated_values() -> None:
    """Each draw's median is numpy's of the values written out as often as their image is drawn."""
    random = np.random.default_rng(5)
    images = 12
    sides = [
        Values(random.normal(size=size), random.integers(images, size=size)) for size in (37, 24)
    ]
    drawn = drawn_images(images)
    differences = []
    for times in drawn:
        one, two = (np.median(np.repeat(side.values, times[side.images])) for side in sides)
        differences.append(two - one)
    found = paired_median(*sides, drawn)
    assert found.interval == pytest.approx(tuple(np.percentile(differences, [2.5, 97.5])))
    assert found.difference == pytest.approx(
        np.median(sides[1].values) - np.median(sides[0].values)
    )


def test_pairing_takes_out_what_is_hard_for_both() -> None:
    """A run that is better by the same in every image differs surely, however images differ."""
    images = 40
    hard = np.linspace(0.0, 100.0, images)
    other = sums_by_image(hard.tolist(), list(range(images)), images)
    run = sums_by_image((hard - 1.0).tolist(), list(range(images)), images)
    found = paired_ratio(other, run, drawn_images(images))
    assert found.difference == pytest.approx(-1.0)
    assert found.interval == pytest.approx((-1.0, -1.0))


def test_what_nothing_defines_has_no_figure() -> None:
    """No image, or a run without a single unit: no value, no difference, no interval."""
    nothing = sums_by_image([], [], 3)
    some = sums_by_image([1.0, 0.0], [0, 2], 3)
    found = paired_ratio(nothing, some, drawn_images(3))
    assert (found.other.value, found.run.value, found.difference) == (None, 0.5, None)
    empty = sums_by_image([], [], 0)
    assert paired_ratio(empty, empty, drawn_images(0)).interval is None
    few = sums_by_image([1.0], [1], 3)
    assert paired_ratio(few, few, drawn_images(3)).interval is None, "most draws leave it out"
