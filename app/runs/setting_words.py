"""The settings of a run in words: one table for the form, the run's page and the REST documents.

Code says `level_sigma_m`; people are told what it is, in which unit, and what changing it does.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from app.domain.fusion_settings import FusionSettings, MatchingMethod, Preset
from app.domain.vessel_state import TrackMethod


class SettingWords(NamedTuple):
    """What a setting is called, its unit with a leading space, and one line of help."""

    label: str
    unit: str
    help: str


class ShownSetting(NamedTuple):
    """A setting of a run as its page shows it."""

    label: str
    value: str
    help: str


PRESETS = {
    Preset.WATERLINE: "waterline: all vessels of half an hour on one water surface",
    Preset.PAPER: "paper: the published method, reproduced exactly",
}
MATCHINGS = {
    MatchingMethod.PAPER: "paper: the published cost in pixels",
    MatchingMethod.LIKELIHOOD: "likelihood: how probable, against no AIS and not detected",
    MatchingMethod.TRACK_VOTES: "track votes: likelihood, and all boxes of a track vote",
    MatchingMethod.LU_2021: "Lu 2021: nearest in distance and bearing",
    MatchingMethod.GROUND_PLANE: "ground plane: metres on the water (2022, 2024)",
    MatchingMethod.HUANG_2021: "Huang 2021: tracks, in metres on the water",
    MatchingMethod.QU_2022: "Qu 2022: tracks, when the vessel is at that place",
}
TRACK_METHODS = {
    TrackMethod.HEADING_DR: "along the heading, as published",
    TrackMethod.COG_DR: "along the course over ground",
    TrackMethod.CTRV_DAMPED: "along the course, which turns on for a while",
    TrackMethod.HERMITE: "between the reports before and after",
}
DECODINGS = {
    1: "in full",
    2: "at half of their sides, where enough is left",
    4: "at a quarter of their sides, where enough is left",
    8: "at an eighth of their sides, where enough is left",
}
CHOICES: dict[str, Mapping[Any, str]] = {
    "matching": MATCHINGS,
    "track_method": TRACK_METHODS,
    "decoding_divisor": DECODINGS,
}
OWN = "the estimator's own"
PROVEN = "in full, or smaller where the site's ground truth proves it harmless"

SETTINGS: dict[str, SettingWords] = {
    "matching": SettingWords(
        "Matching", "", "How it is decided which detection shows which vessel."
    ),
    "score_threshold": SettingWords(
        "Least score", "", "Detections the detector is less sure of are left out."
    ),
    "nms_iou": SettingWords(
        "Overlap of two boxes", " IoU", "Of boxes that overlap more only the surest stays."
    ),
    "class_ids": SettingWords(
        "Classes", " (COCO)", "The detector's classes that count as vessels; 8 is boat."
    ),
    "decoding_divisor": SettingWords(
        "Photographs are decoded",
        "",
        "Smaller is faster and may change boxes: see AP beside whole ones in the detector table.",
    ),
    "border_tolerance_px": SettingWords(
        "Border", " px", "A box this near to the image's border counts as cut by it."
    ),
    "maximum_cost": SettingWords(
        "Highest matching cost", "", "Of matching paper only: pairs above it are no match."
    ),
    "maximum_report_age_s": SettingWords(
        "Oldest report", " s", "Vessels not heard for longer are in no picture."
    ),
    "maximum_range_m": SettingWords(
        "Longest range", " m", "Vessels farther from the camera are in no picture."
    ),
    "track_method": SettingWords(
        "Positions at the image's time",
        "",
        "How a vessel is carried from its reports to the image.",
    ),
    "image_margin": SettingWords(
        "Side margin", " widths", "Vessels this far beside the image may still reach into it."
    ),
    "unidentified_per_image": SettingWords(
        "Detections without AIS", " an image", "How many to expect that show no vessel with AIS."
    ),
    "detected_share": SettingWords(
        "Share detected", "", "How many of the vessels with AIS the detector is expected to find."
    ),
    "score_weight": SettingWords(
        "Weight of a detection's score", "", "Of matching likelihood: 0 takes all boxes alike."
    ),
    "score_center": SettingWords(
        "Even score", " (log odds)", "A score that speaks neither for nor against a vessel."
    ),
    "series_gap_s": SettingWords(
        "Pause within a series", " s", "Images at most so far apart are one series: tracks run on."
    ),
    "level_sigma_m": SettingWords(
        "Water level known to", " m (one sigma)", "How far the water may be from the level given."
    ),
    "level_window_s": SettingWords(
        "Water stands still for", " s", "Images within this time share one water level."
    ),
    "rotation_sigma_deg": SettingWords(
        "Registration known to",
        "° (one sigma)",
        "How far the camera may be turned, beyond what its registration says.",
    ),
    "box_sigma_px": SettingWords(
        "Box edges known to",
        " px (one sigma)",
        "How far a detection's edges are usually off a vessel's; the ships themselves tell more.",
    ),
}


def shown(parameters: Mapping[str, Any]) -> list[ShownSetting]:
    """Return a run's settings as its page shows them; one of other versions by its own name."""
    return [
        ShownSetting(words.label, _value(name, parameters[name]) + words.unit, words.help)
        for name in parameters
        for words in (SETTINGS.get(name) or SettingWords(_spelt_out(name), "", ""),)
    ]


def choices(name: str) -> list[tuple[str, str]]:
    """Return what may be chosen for a setting; the empty choice comes first."""
    own = PROVEN if name == "decoding_divisor" else OWN
    return [("", own), *((str(one), text) for one, text in CHOICES[name].items())]


def described() -> str:
    """Return all settings with their defaults, as REST's documents tell them."""
    defaults = FusionSettings()
    lines = (
        f"- `{name}` ({_default(name, defaults)}{words.unit}): {words.label}. {words.help}"
        for name, words in SETTINGS.items()
    )
    return "What shall differ from the preset's own settings:\n\n" + "\n".join(lines)


def _default(name: str, defaults: FusionSettings) -> str:
    value = getattr(defaults, name)
    if value is None or isinstance(value, MatchingMethod):
        return OWN
    return _value(name, value)


def _value(name: str, value: object) -> str:
    if value is None:
        return OWN
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if name in CHOICES and value in CHOICES[name]:
        return CHOICES[name][value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def _spelt_out(name: str) -> str:
    return name.replace("_", " ").capitalize()
