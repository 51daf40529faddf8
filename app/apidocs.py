"""The REST interface's page for people, made on the server from the OpenAPI document.

The usual viewers bring scripts and inline styles from elsewhere; the pages' policy allows neither,
and a reference needs none: every operation with whom it is for, its parameters, and an example of
what goes in and what comes out.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass

from fastapi import APIRouter, Depends, Request, Response

from app.auth.access import public
from app.openapi_examples import Json, example_of, resolved
from app.templating import page

router = APIRouter(include_in_schema=False)
METHODS = ("get", "post", "put", "patch", "delete")


@dataclass(frozen=True, slots=True)
class Parameter:
    """A part of the address, the query or the headers."""

    name: str
    place: str
    kind: str
    required: bool
    description: str


@dataclass(frozen=True, slots=True)
class Body:
    """What goes in or comes out: its media type and an example."""

    media_type: str
    example: str


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer: its status, what it means, its body."""

    status: str
    description: str
    body: Body | None


@dataclass(frozen=True, slots=True)
class Operation:
    """One method of one path."""

    anchor: str
    method: str
    path: str
    summary: str
    description: str
    needs: str
    parameters: list[Parameter]
    body: Body | None
    answers: list[Answer]


@router.get("/api/v1/docs", dependencies=[Depends(public)])
def show_docs(request: Request) -> Response:
    """Show the reference of the REST interface."""
    document: Json = request.app.openapi()
    return page(
        request, "apidocs.html", groups=grouped(document), openapi_url=request.app.openapi_url
    )


def grouped(document: Json) -> dict[str, list[Operation]]:
    """Return the operations of an OpenAPI document by their tag, in the document's order."""
    groups: dict[str, list[Operation]] = {}
    for path, item in document["paths"].items():
        for method in METHODS:
            if method in item:
                tag = (item[method].get("tags") or ["other"])[0]
                groups.setdefault(tag, []).append(_operation(document, method, path, item[method]))
    return groups


def _operation(document: Json, method: str, path: str, operation: Json) -> Operation:
    summary, _, rest = operation.get("description", "").partition("\n\n")
    return Operation(
        anchor=operation["operationId"],
        method=method.upper(),
        path=path,
        summary=summary or operation.get("summary", ""),
        description=rest,
        needs=_needs(operation),
        parameters=[_parameter(document, part) for part in operation.get("parameters", [])],
        body=_body(document, operation.get("requestBody", {})),
        answers=[
            _answer(document, status, answer)
            for status, answer in operation.get("responses", {}).items()
        ],
    )


def _answer(document: Json, status: str, answer: Json) -> Answer:
    if "$ref" in answer:  # a problem, whose shape is shown once, as the default
        shared = document["components"]["responses"][answer["$ref"].rpartition("/")[2]]
        return Answer(status, shared["description"], None)
    return Answer(status, answer.get("description", ""), _body(document, answer))


def _needs(operation: Json) -> str:
    security = operation.get("security")
    if not security:
        return "for everybody"
    scopes = [scope for requirement in security for part in requirement.values() for scope in part]
    return f"scope {', '.join(scopes)}" if scopes else "any signed-in caller"


def _parameter(document: Json, parameter: Json) -> Parameter:
    schema = resolved(document, parameter.get("schema", {}))
    return Parameter(
        name=parameter["name"],
        place=parameter["in"],
        kind=_kind(document, schema),
        required=parameter.get("required", False),
        description=parameter.get("description") or schema.get("description", ""),
    )


def _kind(document: Json, schema: Json) -> str:
    if "enum" in schema:
        return " | ".join(str(value) for value in schema["enum"])
    if "anyOf" in schema:
        kinds = [_kind(document, resolved(document, part)) for part in schema["anyOf"]]
        return " | ".join(kind for kind in kinds if kind != "null")
    kind = str(schema.get("type", "any"))
    if kind == "array":
        return f"list of {_kind(document, resolved(document, schema.get('items', {})))}"
    return str(schema.get("format", kind))


def _body(document: Json, part: Json) -> Body | None:
    for media_type, media in part.get("content", {}).items():
        schema = media.get("schema", {})
        if "json" not in media_type and "example" in media:
            return Body(media_type, media["example"])
        if "json" not in media_type:
            fields = "\n".join(_form_fields(document, resolved(document, schema)))
            return Body(media_type, fields)
        value = media["example"] if "example" in media else example_of(document, schema)
        return Body(media_type, json.dumps(value, indent=2, ensure_ascii=False))
    return None


def _form_fields(document: Json, schema: Json) -> Iterator[str]:
    required = schema.get("required", [])
    for name, field in schema.get("properties", {}).items():
        need = "" if name in required else " (optional)"
        kind_of = resolved(document, field)
        kind = "file" if "contentMediaType" in kind_of else _kind(document, kind_of)
        yield f"{name}: {kind}{need}"
