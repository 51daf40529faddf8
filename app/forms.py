"""HTML forms: what was entered, read by the same models as REST, and shown again when it is wrong.

Field names are the models' own, with dots for what is nested (`origin.lat_deg`), so an error's
place in the data is the name of the field it is shown at.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Request
from pydantic import BaseModel, ValidationError

from app.errors import AppError, Conflict, FieldError, Invalid, PreconditionFailed

# What is wrong with an entry, and so is shown at the form; other errors have pages of their own.
ENTRY_ERRORS = (Conflict, Invalid, PreconditionFailed)
MOST_FIELDS = 200
Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Form:
    """A form to show: values by field, errors by field, and what is wrong with it as a whole."""

    values: Mapping[str, Any] = field(default_factory=dict)
    errors: Mapping[str, str] = field(default_factory=dict)
    message: str = ""

    def value(self, name: str) -> object:
        """Return what stands in a field."""
        value = self.values.get(name)
        return "" if value is None else value

    def error(self, name: str) -> str:
        """Return what is wrong with a field, or nothing."""
        return self.errors.get(name, "")


async def _submitted(request: Request) -> dict[str, str]:
    form = await request.form(max_fields=MOST_FIELDS)
    return {name: value for name, value in form.items() if isinstance(value, str)}


Submitted = Annotated[dict[str, str], Depends(_submitted)]


def rejected(values: Mapping[str, Any], error: AppError) -> Form:
    """Return a form with what was entered and why it was refused."""
    errors = {part.field: part.message for part in error.fields}
    all_shown = bool(errors) and errors.keys() <= values.keys()
    return Form(values, errors, "" if all_shown else error.detail)


def parse(model: type[Model], values: Mapping[str, Any]) -> Model:
    """Read a submitted form. Empty fields count as left out. Raises Invalid naming the fields."""
    nested: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, str) and not value.strip():
            continue
        inner = nested
        *outer, last = name.split(".")
        for step in outer:
            inner = inner.setdefault(step, {})
        inner[last] = value
    try:
        return model.model_validate(nested)
    except ValidationError as error:
        raise _invalid(error) from error


def check_version(values: Mapping[str, str], version: int) -> None:
    """Compare the version a form was shown with the present one. Raises PreconditionFailed."""
    if values.get("version") != str(version):
        raise PreconditionFailed(
            "somebody else changed it while you were editing; compare with the present values and "
            "save again"
        )


def _invalid(error: ValidationError) -> Invalid:
    fields = tuple(
        FieldError(
            ".".join(str(step) for step in part["loc"]),
            _plain(part["type"], part["msg"]),
        )
        for part in error.errors()
    )
    return Invalid(
        "; ".join(f"{part.field} {part.message}".strip() for part in fields), fields=fields
    )


def _plain(kind: str, message: str) -> str:
    match kind:
        case "missing":
            return "fill this in"
        case "float_parsing":
            return "must be a number, with a point before the decimals"
        case "int_parsing" | "int_from_float":
            return "must be a whole number"
        case "datetime_parsing" | "datetime_from_date_parsing":
            return "must be a moment such as 2026-11-22 10:00:05"
    return message.removeprefix("Value error, ").replace("Input should be", "must be")
