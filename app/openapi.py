"""The OpenAPI document as the framework writes it, with the errors as they really are.

The framework describes its own form of a validation error, which nobody here ever gets: every
error is a problem (RFC 9457), so the document says that, once for each operation.
"""

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel, Field

PROBLEM = "#/components/schemas/Problem"
_REPLACED = ("HTTPValidationError", "ValidationError")


class ProblemField(BaseModel):
    """What is wrong with one field, and how to mend it."""

    field: str = Field(examples=["keypoints.3.u_px"])
    message: str = Field(examples=["Input should be a finite number"])


class Problem(BaseModel):
    """Why a request failed, in words somebody can act on (RFC 9457)."""

    type: str = Field("about:blank")
    title: str = Field(examples=["Invalid input"])
    status: int = Field(examples=[422])
    detail: str = Field(examples=["keypoints.3.u_px: Input should be a finite number"])
    errors: list[ProblemField] = Field(default_factory=list)


def describe_problems(app: FastAPI) -> None:
    """Make the application's OpenAPI document tell its errors as problems."""
    written = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            _replace(written())
        return written()

    # FastAPI's documented way to change its document.
    app.openapi = openapi  # type: ignore[method-assign]


def _replace(document: dict[str, Any]) -> None:
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    for name in _REPLACED:
        schemas.pop(name, None)
    problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas |= problem.pop("$defs") | {"Problem": problem}
    for path in document["paths"].values():
        for operation in path.values():
            operation["responses"].pop("422", None)
            operation["responses"]["default"] = {
                "description": "Any failure",
                "content": {"application/problem+json": {"schema": {"$ref": PROBLEM}}},
            }
