"""A run's parameters: the fusion settings a person may choose, checked before they are stored."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from pydantic import TypeAdapter, ValidationError

from app.domain.fusion_settings import FusionSettings, Preset
from app.errors import FieldError, Invalid

_ADAPTER = TypeAdapter(FusionSettings)


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
            f"parameters.{unknown[0]}", f"is no parameter; there are {', '.join(sorted(known))}"
        )
    try:
        return _ADAPTER.validate_python({"preset": preset, **overrides})
    except ValidationError as error:
        problems = tuple(
            FieldError(
                ".".join(["parameters", *(str(part) for part in problem["loc"])]),
                problem["msg"].removeprefix("Value error, "),
            )
            for problem in error.errors()
        )
        first = problems[0]
        raise Invalid(f"{first.field}: {first.message}", fields=problems) from error


def as_json(settings: FusionSettings) -> dict[str, Any]:
    """Return the settings as they are stored with a run."""
    return {name: value for name, value in asdict(settings).items() if name != "preset"}
