"""Where a file was before it came: kept for people to recognise, never used as a path here."""

import hashlib
import unicodedata

LONGEST = 500
# What systems put beside people's files.
LITTER = frozenset({"thumbs.db", "desktop.ini", "ehthumbs.db"})
PHOTOGRAPHS = (".jpg", ".jpeg", ".jpe", ".png", ".webp", ".mpo")
ARCHIVES = (".zip",)


def path_key(path: str) -> str:
    """Return what tells two paths apart however long and strange they are."""
    return hashlib.sha256(path.encode("utf-8", "surrogatepass")).hexdigest()


def shown(path: str) -> str:
    """Return a path fit to be stored and shown: no control characters, of sane length."""
    visible = "".join(
        letter for letter in path.replace("\\", "/") if unicodedata.category(letter)[0] != "C"
    ).strip()
    if len(visible) > LONGEST:
        visible = f"…{visible[1 - LONGEST :]}"
    return visible or "unnamed"


def is_litter(path: str) -> bool:
    """Whether a path is hidden or made by a system: nothing a person wants imported."""
    parts = [part for part in path.replace("\\", "/").split("/") if part not in {"", ".", ".."}]
    return (
        not parts
        or any(part.startswith(".") or part == "__MACOSX" for part in parts)
        or parts[-1].lower() in LITTER
    )


def is_archive(path: str) -> bool:
    """Whether a path is named as an archive of photographs is."""
    return path.lower().endswith(ARCHIVES)


def is_photograph(path: str) -> bool:
    """Whether a path is named as a photograph is."""
    return path.lower().endswith(PHOTOGRAPHS)
