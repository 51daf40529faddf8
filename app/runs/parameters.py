"""A run's parameters: the fusion settings a person may choose, checked before they are stored."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from pydantic import TypeAdapter, ValidationError

from app.domain.fusion_settings import MATCHING_OF, FusionSettings, MatchingMethod, Preset
from app.errors import FieldError, Invalid
from app.ids import LARGEST_ROW_ID

_ADAPTER = TypeAdapter(FusionSettings)
# Beyond these a number is a slip of the hand: it would keep a worker busy for nothing.
_LARGEST = {
    "border_tolerance_px": 10_000.0,
    "maximum_cost": 1e6,
    "maximum_report_age_s": 3600.0,
    "maximum_range_m": 100_000.0,
}
_MOST_CLASSES = 1000


def fusion_settings(preset: str, overrides: Mapping[str, Any]) -> FusionSettings:
    """Return the settings of a preset with some numbers changed.

    Raises Invalid naming `preset` or `parameters.<name>`, what is wrong and what would be right.
    """
    if preset not in set(Preset):
        raise Invalid.field("preset", f"must be one of {', '.join(Preset)}")
    known = {field.name for field in fields(FusionSettings)} - {"preset"}
    unknown = sorted(set(overrides) - known)
    if unknown:
        raise Invalid.field(
            f"parameters.{unknown[0][:64]}",
            f"is no parameter; there are {', '.join(sorted(known))}",
        )
    try:
        settings = _ADAPTER.validate_python(
            {"preset": preset, "matching": MATCHING_OF[Preset(preset)], **overrides}
        )
    except ValidationError as error:
        problems = tuple(_problem(problem["loc"], problem["msg"]) for problem in error.errors())
        first = problems[0]
        raise Invalid(f"{first.field}: {first.message}", fields=problems) from error
    _refuse_slips(settings)
    return settings


def require_used(preset: str, overrides: Mapping[str, Any]) -> None:
    """Raise Invalid for a highest matching cost where the matching has no such cost.

    Whoever sets it expects it to leave pairs out. The default may be said again, so that a run's
    own parameters start another.
    """
    standard = FusionSettings().maximum_cost
    own = {str(of): matching for of, matching in MATCHING_OF.items()}.get(preset)
    matching = overrides.get("matching", own)
    if overrides.get("maximum_cost", standard) == standard or matching == MatchingMethod.PAPER:
        return
    if matching in list(MatchingMethod):
        raise Invalid.field(
            "parameters.maximum_cost",
            f"has no effect with matching {matching}, which leaves unlikely pairs out by itself; "
            "leave it out, or choose matching paper",
        )


def _problem(place: tuple[int | str, ...], message: str) -> FieldError:
    """Name the parameter, also where only the message of the settings themselves does."""
    message = message.removeprefix("Value error, ")
    if not place:
        name, _, message = message.partition(" ")
        place = (name,)
    return FieldError(".".join(["parameters", *map(str, place)]), message)


def _refuse_slips(settings: FusionSettings) -> None:
    for name, largest in _LARGEST.items():
        if getattr(settings, name) > largest:
            raise Invalid.field(f"parameters.{name}", f"must be at most {largest:g}")
    ids = settings.class_ids
    if len(ids) > _MOST_CLASSES or not all(0 <= class_id < LARGEST_ROW_ID for class_id in ids):
        raise Invalid.field(
            "parameters.class_ids", f"must be at most {_MOST_CLASSES} classes from 0 on"
        )


def as_json(settings: FusionSettings) -> dict[str, Any]:
    """Return the settings as they are stored with a run."""
    return {name: value for name, value in asdict(settings).items() if name != "preset"}
