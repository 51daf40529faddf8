"""What reviews of one harbour teach for other days of its kind.

Simulated reviewers know the truth: they grade every match of some harbours' images and mark each
visible vessel without one. Chances are fitted to those, then other harbours with the same share of
silent vessels and the same detector are matched anew, with the usual and with the fitted chances.
"""

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from app.domain.fusion_settings import FusionSettings, MatchingMethod
from app.domain.likelihood import Odds
from app.domain.pairing import MatchedImage, match_images
from app.domain.prior_gain import held_out_gain, silent_share
from app.domain.priors import GradedBox, GradedImage, GradedPair, Priors, fit_priors
from app.domain.sighting import SeenImage
from app.evaluation.service import LEAST_VISIBLE
from app.simulation.harbour import Frame, make_harbour
from app.simulation.truth import VesselClass
from benchmarks.bench_accuracy import heard, registered, states, under
from benchmarks.bench_matching import SETTINGS, TRACKING

IMAGES = 40
TAUGHT, UNSEEN = range(3000, 3004), range(3100, 3106)
USUAL = FusionSettings(matching=MatchingMethod.LIKELIHOOD)
# A port where four vessels in ten are silent, and a detector that overlooks and invents much.
PORT = replace(
    SETTINGS,
    traffic=replace(SETTINGS.traffic, no_ais_share=0.4),
    detector=replace(SETTINGS.detector, miss_share=0.25, false_positives_per_image=2.0),
)


@dataclass(frozen=True, slots=True)
class Judged:
    """A harbour's matches, right and wrong, of so many that could be; log loss a match."""

    right: int
    wrong: int
    matchable: int
    log_loss: float


def graded(seed: int, settings: FusionSettings) -> list[GradedImage]:
    """Match a harbour, and review all of it."""
    harbour = make_harbour(seed, IMAGES, settings=PORT)
    positions, statics = heard(harbour)
    found: list[GradedImage] = []
    for viewport, camera in registered(harbour).items():
        frames = [frame for frame in harbour.frames if frame.viewport.name == viewport]
        seen = [
            SeenImage(
                frame.detections,
                list(states(frame, positions, statics, TRACKING)),
                harbour.site.water_level_m,
                frame.captured_at.timestamp(),
            )
            for frame in frames
        ]
        matched = match_images(camera, harbour.frame, seen, settings)
        found += [review(seed, *one) for one in zip(frames, matched, strict=True)]
    return found


def review(seed: int, frame: Frame, matched: MatchedImage) -> GradedImage:
    """Say of one image what a reviewer would."""
    shown = [under((d.x1_px, d.y1_px, d.x2_px, d.y2_px), frame.truth) for d in frame.detections]
    vessels = [None if one is None else one.mmsi for one in shown]
    visible = [
        one
        for one in frame.truth
        if one.visible_fraction >= LEAST_VISIBLE and one.class_name is not VesselClass.SUBVESSEL
    ]
    return GradedImage(
        id=1000 * seed + frame.image_id,
        # Another seed is another month.
        at_s=frame.captured_at.timestamp() + 30 * 86400 * seed,
        used=Priors(),
        boxes=[GradedBox(d.score, v) for d, v in zip(frame.detections, vessels, strict=True)],
        pairs=[
            GradedPair(
                pair.detection.score,
                int(pair.candidate.state.identifier),
                pair.cost.total,
                pair.cost.probability if isinstance(pair.cost, Odds) else None,
                vessels[pair.detection_index] == int(pair.candidate.state.identifier),
            )
            for pair in matched.pairs
        ],
        not_detected=sum(one.mmsi is not None and one.mmsi not in vessels for one in visible),
        silent=sum(one.mmsi is None for one in visible),
        visible=len(visible),
    )


def judged(images: Sequence[GradedImage]) -> Judged:
    """Count what reviewers said of a harbour."""
    pairs = [pair for image in images for pair in image.pairs]
    loss = [
        -np.log(np.clip(p.probability if p.right else 1 - p.probability, 1e-6, 1))
        for p in pairs
        if p.probability is not None
    ]
    return Judged(
        sum(pair.right for pair in pairs),
        sum(not pair.right for pair in pairs),
        sum(image.visible - image.silent for image in images),
        float(np.mean(loss)),
    )


def main() -> None:
    """Teach, then judge on harbours nobody reviewed."""
    begun = time.monotonic()
    with ProcessPoolExecutor(2) as pool:
        taught = [
            image for one in pool.map(partial(graded, settings=USUAL), TAUGHT) for image in one
        ]
        silent, fitted, gain = silent_share(taught), fit_priors(taught), held_out_gain(taught)
        print(f"{len(taught)} images graded; injected: 40 % of passing vessels silent, 25 % missed")
        print(f"silent share {silent.share:.3f} [{silent.low:.3f}, {silent.high:.3f}]")
        print(f"fitted: {fitted.as_settings()}")
        print(f"held out: now {gain.now}, fitted {gain.fitted}, log loss {gain.loss_change}")
        for label, settings in (
            ("usual", USUAL),
            ("fitted", replace(USUAL, **fitted.as_settings())),
        ):
            results = [judged(one) for one in pool.map(partial(graded, settings=settings), UNSEEN)]
            right, wrong = sum(r.right for r in results), sum(r.wrong for r in results)
            idf1 = 200 * right / (right + wrong + sum(r.matchable for r in results))
            loss = [round(r.log_loss, 3) for r in results]
            print(
                f"unseen, {label}: {right} right, {wrong} wrong, IDF1 {idf1:.1f} %; losses {loss}"
            )
    print(f"took {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    main()
