"""Bodies that routes read by themselves, told in the OpenAPI document.

A table or a collection comes as it was saved, not as a JSON object of fields; the framework knows
nothing of what a route takes from the stream, so the route says it: `openapi_extra=CSV_BODY`.
"""

from typing import Any

PART_OF_FILE: dict[int | str, dict[str, Any]] = {
    206: {"description": "The part that `Range` asks for"},
    304: {"description": "The file is the one that `If-None-Match` names"},
    416: {"description": "The file has no such part"},
}


def text_body(media_type: str, example: str) -> dict[str, Any]:
    """Return the part of an operation's document for a text as its body, with an example."""
    schema = {"type": "string", "minLength": 1}
    content = {media_type: {"schema": schema, "example": example}}
    return {"requestBody": {"required": True, "content": content}}


def json_body(media_type: str, example: dict[str, Any]) -> dict[str, Any]:
    """Return the part of an operation's document for a JSON object as its body, with an example."""
    content = {media_type: {"schema": {"type": "object"}, "example": example}}
    return {"requestBody": {"required": True, "content": content}}


def file_answer(*media_types: str) -> dict[int | str, dict[str, Any]]:
    """Return the `responses` of a route that answers with a file of one of these kinds."""
    octets = {"type": "string", "format": "binary"}
    schemas = {kind: {"type": "object"} if "json" in kind else octets for kind in media_types}
    return {200: {"content": {kind: {"schema": schema} for kind, schema in schemas.items()}}}
