"""The OpenAPI document as a client needs it: what succeeds, in kinds of content it can hold.

A client raises one exception for every failure, so failures need no types here. A file is a file
whatever is in it. What is told in a stream that never ends, and tables that are JSON as well, are
left to the hand-written half.
"""

import json
import re
from typing import Any

FILE = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}
TEXT = {"text/plain": {"schema": {"type": "string"}}}


def for_client(document: dict[str, Any]) -> dict[str, Any]:
    """Return an OpenAPI document of which a client is generated well."""
    document = json.loads(re.sub(r"\bBody_(\w+)", r"\1_form", json.dumps(document)))
    for path, item in list(document["paths"].items()):
        for method, operation in list(item.items()):
            contents = _successes(operation)
            if any("text/event-stream" in content for content in contents):
                del item[method]
                continue
            _simplify_answers(operation)
            for media_type, media in operation.get("requestBody", {}).get("content", {}).items():
                if "json" not in media_type and "form" not in media_type:
                    media["schema"] = FILE["application/octet-stream"]["schema"]
            operation["tags"] = operation.get("tags", [])[:1]
        if not item:
            del document["paths"][path]
    for schema in document["components"]["schemas"].values():
        _take_files(schema)
    return document


def _successes(operation: dict[str, Any]) -> list[dict[str, Any]]:
    answers = operation["responses"]
    return [answer.get("content", {}) for status, answer in answers.items() if status[0] == "2"]


def _simplify_answers(operation: dict[str, Any]) -> None:
    """Keep answers of 2xx, each with one kind of content."""
    answers = operation["responses"]
    kept = {status: answer for status, answer in answers.items() if status[0] == "2"}
    for answer in kept.values():
        content = answer.get("content")
        if not content:
            continue
        if "application/json" in content and len(content) > 1:
            parameters = operation.get("parameters", [])
            operation["parameters"] = [one for one in parameters if one["name"] != "format"]
        answer["content"] = _kind(content)
    operation["responses"] = kept


def _kind(content: dict[str, Any]) -> dict[str, Any]:
    for media_type, media in content.items():
        if "json" in media_type:
            is_file = any("zip" in other for other in content)
            return FILE if is_file else {"application/json": media}
        if media_type.startswith("text/") or "svg" in media_type:
            return TEXT
    return FILE


def _take_files(schema: dict[str, Any]) -> None:
    """Call files in forms by the older name for them, which the generator knows."""
    for field in schema.get("properties", {}).values():
        for part in [field, field.get("items", {}), *field.get("anyOf", [])]:
            if part.pop("contentMediaType", None):
                part["format"] = "binary"
