"""By how much a photograph may be decoded smaller."""

import pytest

from app.domain.detection import DetectionSettings
from app.domain.fusion_settings import FusionSettings
from app.domain.reduced_decoding import divisor_for


@pytest.mark.parametrize(
    ("image", "needed", "most", "divisor"),
    [
        ((2560, 1920), (416, 312), 8, 4),
        ((2560, 1920), (416, 312), 2, 2),
        ((2560, 1920), (320, 240), 8, 8),
        ((2560, 1920), (321, 240), 8, 4),
        ((2560, 1920), (1281, 961), 8, 1),
        ((2562, 1920), (416, 312), 8, 2),
        ((2561, 1920), (416, 312), 8, 1),
        ((200, 100), (416, 208), 8, 1),
    ],
)
def test_enough_is_left_and_no_pixel_is_cut(
    image: tuple[int, int], needed: tuple[int, int], most: int, divisor: int
) -> None:
    """At least what the network is given, at most what is allowed, and no rest of a division."""
    assert divisor_for(image, needed, most) == divisor


def test_boxes_of_smaller_photographs_have_a_key_of_their_own() -> None:
    """Boxes found in whole photographs keep the key they always had; other divisors are refused."""
    whole, half = DetectionSettings(), DetectionSettings(decoding_divisor=2)
    assert "decoding_divisor" not in whole.canonical_json
    assert whole.sha256 != half.sha256
    for settings in (DetectionSettings, FusionSettings):
        with pytest.raises(ValueError, match="decoding_divisor must be one of"):
            settings(decoding_divisor=3)
