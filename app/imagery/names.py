"""File names from outside: kept for people to recognise, never used as a path or sent raw."""

import re
import unicodedata
from urllib.parse import quote

LONGEST = 200


def tidy(file_name: str | None, media_type: str) -> str:
    """Return a name without folders, control characters and direction marks, of sane length."""
    ending = media_type.rpartition("/")[2].replace("jpeg", "jpg")
    name = re.split(r"[/\\]", file_name or "")[-1]
    visible = "".join(letter for letter in name if unicodedata.category(letter)[0] != "C")
    visible = visible.strip(" .")
    if not visible:
        return f"image.{ending}"
    stem, dot, suffix = visible.rpartition(".")
    if dot and len(suffix) <= 5:
        return f"{stem[: LONGEST - 6]}.{suffix}"
    return visible[:LONGEST]


def content_disposition(file_name: str) -> str:
    """Return the header that names a shown file, encoded after RFC 5987 (and plain ASCII)."""
    plain = re.sub(r"[^A-Za-z0-9._ -]", "_", file_name)
    return f"inline; filename=\"{plain}\"; filename*=UTF-8''{quote(file_name, safe='')}"
