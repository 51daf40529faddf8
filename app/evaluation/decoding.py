"""Whether a detector may look at photographs decoded smaller: what ground truth says of its AP.

A run over images with ground truth, its photographs decoded smaller, and one with the same settings
and whole photographs are two detectors in the table. Where AP of each class set is the same to
0.002, on enough boxes to tell, new runs of the site decode smaller without being told to.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from app.domain.average_precision import Size
from app.domain.detection import DetectionSettings
from app.domain.reduced_decoding import DIVISORS
from app.evaluation import found_repository as repository
from app.evaluation.detector_figures import figures_on
from app.evaluation.found_repository import FoundSet, TrueImage

LARGEST_CHANGE = 0.002
LEAST_BOXES = 100


@dataclass(frozen=True, slots=True)
class DecodingChange:
    """How AP changes when photographs are decoded smaller, by class set, on the same images."""

    images: int
    boxes: int
    ap: Mapping[str, float]

    @property
    def is_harmless(self) -> bool:
        """Whether AP stays, as far as enough boxes can tell."""
        return self.boxes >= LEAST_BOXES and all(
            abs(change) <= LARGEST_CHANGE for change in self.ap.values()
        )


def decoding_change(
    session: Session,
    images: Sequence[TrueImage],
    whole: Sequence[FoundSet],
    reduced: Sequence[FoundSet],
) -> DecodingChange | None:
    """Compare what was found in whole and in reduced photographs; None without a common image."""
    both = {one.image_sha256 for one in whole} & {one.image_sha256 for one in reduced}
    common = [image for image in images if image.content_sha256 in both]
    if not common:
        return None
    before, after = (
        figures_on(session, common, [one for one in sets if one.image_sha256 in both]).sets
        for sets in (whole, reduced)
    )
    changes = {
        old.class_set.name: new_ap - old_ap
        for old, new in zip(before, after, strict=True)
        if (old_ap := old.by_size[Size.ALL].ap) is not None
        and (new_ap := new.by_size[Size.ALL].ap) is not None
    }
    boxes = max(one.by_size[Size.ALL].boxes for one in before)
    return DecodingChange(len(common), boxes, changes)


def proven_divisor(
    session: Session, site_id: int, model_sha256: str, settings: DetectionSettings
) -> int:
    """Return by how much a site's photographs may be decoded smaller without a harm to AP."""
    others = {
        replace(settings, decoding_divisor=divisor).sha256: divisor
        for divisor in DIVISORS
        if divisor > 1
    }
    if not repository.has_sets(session, model_sha256, list(others)):
        return 1
    images = repository.complete_images_of_site(session, site_id)
    by_settings: dict[str, list[FoundSet]] = {}
    for one in repository.sets(session, images, model_sha256):
        by_settings.setdefault(one.settings_sha256, []).append(one)
    whole = by_settings.get(replace(settings, decoding_divisor=1).sha256, [])
    for sha256, divisor in sorted(others.items(), key=lambda pair: -pair[1]):
        change = decoding_change(session, images, whole, by_settings.get(sha256, []))
        if change is not None and change.is_harmless:
            return divisor
    return 1
