"""Examples for a JSON schema: a value it allows, its own one where it gives any."""

from collections.abc import Mapping
from typing import Any, TypeAlias

Json: TypeAlias = Mapping[str, Any]
DEEP, DEEPEST = 3, 8
_TEXTS = {"date-time": "2026-11-22T10:00:05Z", "date": "2026-11-22", "uri": "https://example.org"}
_SCALARS = {"integer": 1, "number": 1.0, "boolean": True}


def resolved(document: Json, schema: Json) -> Json:
    """Return a schema of an OpenAPI document with its references followed."""
    while "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        schema = document["components"]["schemas"][name]
    return schema


def example_of(document: Json, schema: Json, depth: int = 0) -> object:
    """Return a value that a schema allows; None below a depth that no reader follows."""
    schema = resolved(document, schema)
    given = _given(schema)
    if given is not None or depth >= DEEPEST:
        return given
    for choice in ("anyOf", "oneOf", "allOf"):
        parts = [part for part in schema.get(choice, []) if part.get("type") != "null"]
        if parts:
            is_optional = len(parts) < len(schema[choice])
            return None if is_optional and depth > DEEP else example_of(document, parts[0], depth)
    return _built(document, schema, depth)


def _given(schema: Json) -> object:
    for known in ("example", "const", "default"):
        if schema.get(known) is not None:
            return schema[known]
    for several in ("examples", "enum"):
        if schema.get(several):
            return schema[several][0]
    return None


def _built(document: Json, schema: Json, depth: int) -> object:
    kind = str(schema.get("type"))
    if kind == "object":
        return {
            name: example_of(document, field, depth + 1)
            for name, field in schema.get("properties", {}).items()
        }
    if kind == "array":
        parts = schema.get("prefixItems", [schema.get("items", {})])
        return [example_of(document, part, depth + 1) for part in parts]
    if kind == "string":
        return _TEXTS.get(schema.get("format", ""), "text")
    return _SCALARS.get(kind)
