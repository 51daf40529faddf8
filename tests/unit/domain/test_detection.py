"""Detection settings and their key."""

import pytest

from app.domain.detection import DetectionSettings


def test_equal_settings_have_one_key() -> None:
    """Order and repetition of classes and the kind of number do not change the key."""
    ours = DetectionSettings(class_ids=(8, 3))
    same = DetectionSettings(score_threshold=0.25, nms_iou=0.45, class_ids=(3, 8, 8))
    assert ours.sha256 == same.sha256
    assert DetectionSettings(score_threshold=1).sha256 == DetectionSettings(1.0).sha256


def test_the_key_never_changes() -> None:
    """Detections stored years ago are found again under the default settings."""
    defaults = DetectionSettings()
    assert defaults.canonical_json == '{"class_ids":[8],"nms_iou":0.45,"score_threshold":0.25}'
    assert defaults.sha256 == "4471af70a7a08973890998d3707eafbe3542ecd1233ef982223b1a5891131799"


@pytest.mark.parametrize(
    "other",
    [
        DetectionSettings(score_threshold=0.26),
        DetectionSettings(nms_iou=0.5),
        DetectionSettings(class_ids=(0,)),
    ],
)
def test_other_settings_have_other_keys(other: DetectionSettings) -> None:
    """Every setting that changes boxes changes the key."""
    assert other.sha256 != DetectionSettings().sha256


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"score_threshold": 1.5}, "score_threshold"),
        ({"nms_iou": float("nan")}, "nms_iou"),
        ({"class_ids": ()}, "class_ids"),
        ({"class_ids": (-1,)}, "class_ids"),
    ],
)
def test_settings_out_of_range_are_refused(arguments: dict[str, object], name: str) -> None:
    """A setting out of its range is refused by its name."""
    with pytest.raises(ValueError, match=name):
        DetectionSettings(**arguments)  # type: ignore[arg-type]
