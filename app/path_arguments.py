"""The files that the PATH arguments of an import stand for.

A file that is named is always tried. In a folder, whose content nobody spelled out, only files
with an expected ending are taken, so that a list of checksums beside the photographs is no error.
"""

from collections.abc import Iterable
from pathlib import Path


def files_of(paths: Iterable[Path], endings: frozenset[str]) -> tuple[list[Path], int]:
    """Return the files, each once and in order of their names, and how many others were left out.

    Folders are searched with all folders below them; hidden files and folders are passed over.
    `endings` are lower case with their dot; an empty set takes every file.
    """
    found: dict[Path, None] = {}
    left_out = 0
    for path in paths:
        if not path.is_dir():
            found[path] = None
            continue
        for file in sorted(_visible_files(path)):
            if endings and file.suffix.lower() not in endings:
                left_out += 1
            else:
                found[file] = None
    return list(found), left_out


def _visible_files(folder: Path) -> Iterable[Path]:
    for path in folder.rglob("*"):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.is_file() and not hidden:
            yield path
