"""The OpenAPI document as the framework writes it, with the errors as they really are.

The framework describes its own form of a validation error, which nobody here ever gets: every
error is a problem (RFC 9457), so the document says that for each operation, with the statuses that
follow from what the operation is: for whom, of what, and whether it writes. It also tells the
headers that whole groups of operations take, and gives two schemas of one name two names.
"""

import json
import re
from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute
from pydantic import BaseModel, Field

from app.auth.declared import routes_of
from app.auth.idempotency import HEADER, LONGEST_KEY, IdempotentRoute
from app.dependencies import SAFE_METHODS

PROBLEM = "#/components/schemas/Problem"
_REPLACED = ("HTTPValidationError", "ValidationError")
_QUALIFIED = re.compile(r"app__[a-zA-Z0-9_]+")
MEANINGS = {
    "400": "The request itself is malformed",
    "401": "Nobody is signed in, or the token is not known any more",
    "403": "The caller may not do this",
    "404": "There is no such thing, or none that the caller may see",
    "409": "The present state does not allow it",
    "412": "`If-Match` names another version than the present one",
    "413": "More is sent than is taken here",
    "415": "No kind of content that is taken here",
    "422": "A field is wrong; `errors` names it and the way to mend it",
    "428": "`If-Match` is missing",
    "503": "Too much is asked at once; ask again after `Retry-After` seconds",
    "507": "There is no room left on the disk",
}


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


def operation_id(route: APIRoute) -> str:
    """Return the name that clients have for an operation: its function's, which no other has."""
    return route.name


def describe_problems(app: FastAPI) -> None:
    """Make the application's OpenAPI document tell its errors as problems."""
    written = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            _tell_idempotency(app, written())
            _replace(written())
            app.openapi_schema = _with_single_names(written())
        return written()

    # FastAPI's documented way to change its document.
    app.openapi = openapi  # type: ignore[method-assign]


def _replace(document: dict[str, Any]) -> None:
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    for name in _REPLACED:
        schemas.pop(name, None)
    problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas |= problem.pop("$defs") | {"Problem": problem}
    document["components"]["responses"] = {
        _named(status): {"description": meaning, **_problem_content()}
        for status, meaning in MEANINGS.items()
    }
    for path, item in document["paths"].items():
        for method, operation in item.items():
            answers = operation["responses"]
            answers.pop("422", None)
            for status in _statuses(path, method, operation):
                reference = {"$ref": f"#/components/responses/{_named(status)}"}
                answers.setdefault(status, reference)
            answers["default"] = {"description": "Any other failure", **_problem_content()}


def _problem_content() -> dict[str, Any]:
    return {"content": {"application/problem+json": {"schema": {"$ref": PROBLEM}}}}


def _named(status: str) -> str:
    return f"Problem{status}"


def _statuses(path: str, method: str, operation: dict[str, Any]) -> list[str]:
    """Return the statuses of the failures that an operation can end in."""
    parameters = {parameter["name"] for parameter in operation.get("parameters", [])}
    body = operation.get("requestBody", {}).get("content", {})
    writes = method.upper() not in SAFE_METHODS
    can_happen = {
        "400": True,
        "401": "security" in operation,
        "403": "security" in operation,
        "404": "{" in path or bool(parameters) or bool(body),
        "409": True,
        "412": "If-Match" in parameters,
        "413": writes,
        "415": bool(body),
        "422": bool(parameters) or bool(body),
        "428": "If-Match" in parameters,
        "503": True,
        "507": writes,
    }
    return [status for status, it_can in can_happen.items() if it_can]


def _tell_idempotency(app: FastAPI, document: dict[str, Any]) -> None:
    """Add the header `Idempotency-Key` to the writes that heed it."""
    for route in routes_of(app):
        path = document["paths"].get(getattr(route, "path_format", route.path))
        if not isinstance(route.original_route, IdempotentRoute) or path is None:
            continue
        for method in (route.methods or set()) - SAFE_METHODS:
            operation = path[method.lower()]
            if "multipart/form-data" not in operation.get("requestBody", {}).get("content", {}):
                operation.setdefault("parameters", []).append(IDEMPOTENCY_KEY)


IDEMPOTENCY_KEY = {
    "name": HEADER,
    "in": "header",
    "required": False,
    "description": "A key of your own: the same request with the same key is carried out once and "
    "answered alike for a day",
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY},
    "example": "8b0c1f4e-nightly-export",
}


def _with_single_names(document: dict[str, Any]) -> dict[str, Any]:
    """Name two schemas of one name after their features: `app__runs__schemas__RunIn` is RunsRunIn.

    Generators of clients take the last part of such a name only, and lose one of the two.
    """
    schemas = document["components"]["schemas"]
    names = {name: _single_name(name) for name in schemas if _QUALIFIED.fullmatch(name)}
    names |= {
        name: f"Page_{names[item]}"
        for name, schema in schemas.items()
        if name.startswith("app__paging__Page_")
        and (item := schema["properties"]["items"]["items"]["$ref"].rpartition("/")[2]) in names
    }
    text = json.dumps(document)
    text = _QUALIFIED.sub(lambda found: names.get(found[0], found[0]), text)
    renamed: dict[str, Any] = json.loads(text)
    for name in names.values():
        renamed["components"]["schemas"][name]["title"] = name
    return renamed


def _single_name(name: str) -> str:
    _, *parts, last = name.split("__")
    words = "_".join(part for part in parts if part != "schemas").removesuffix("_schemas")
    return "".join(word.capitalize() for word in words.split("_")) + last
