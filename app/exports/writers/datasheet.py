"""The datasheet: what a data set is, how it came about, and what it is worth, on one page.

It is made of the manifest alone, so it can be had without the archive too. The questions are those
of T. Gebru and others, "Datasheets for Datasets" (2021); the tables are the paper's, for the
selection at hand.
"""

from collections.abc import Mapping, Sequence
from typing import Any

_TITLE = "# Vessel poses from photographs and AIS"
_FRAMES = """\
## Frames and units
Metres, degrees, pixels; (0, 0) is the centre of the first pixel. Camera frame: x right, y down, z
forward (OpenCV). Vessel frame: x forward, y port, z up, around the middle of the box. Corners:
bow-port, bow-starboard, stern-starboard, stern-port at the bottom, then the same at the top.
BOP files are in millimetres. Heights above the WGS84 ellipsoid."""


def datasheet(manifest: Mapping[str, Any]) -> str:
    """Return the datasheet of a manifest (Markdown)."""
    counts = manifest["counts"]
    parts = [
        _TITLE,
        (
            f"Made by Quaymark {manifest['code_version']}. {counts['poses']} poses of "
            f"{counts['vessels']} vessels on {counts['images']} photographs."
        ),
        "## What was selected",
        _bullets(manifest["filters"]) or "Everything; no filter was set.",
        _bullets(manifest["options"]),
        "Vessels are pseudonyms. " + str(manifest["remains"])
        if manifest["anonymised"]
        else "Vessels are told by their MMSI.",
        _split(manifest.get("split")),
        _FRAMES,
        "## Verdicts",
        _grades(counts),
        _matching(manifest.get("matching")),
        "## Registrations (projection error of the keypoints)",
        _registrations(manifest["registrations"]),
        "## How the poses came about",
        _runs(manifest["runs"]),
        "## AIS",
        _recordings(manifest["ais_files"]),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _bullets(values: Mapping[str, object]) -> str:
    return "\n".join(f"- {_text(name)}: {_text(value)}" for name, value in sorted(values.items()))


def _split(split: Mapping[str, Any] | None) -> str:
    if not split:
        return ""
    rows = [(part, count) for part, count in split["poses"].items()]
    kept = {
        "vessel": (
            "No vessel and no convoy (vessels seen within 20 m of each other) is in two parts. A "
            "photograph may be, each time with the vessels of that part alone."
        ),
        "day": "No calendar day of the site is in two parts, whatever the camera.",
    }[split["by"]]
    return f"## Parts\n\n{kept} Seed {split['seed']}.\n\n" + _table(("part", "poses"), rows)


def _grades(counts: Mapping[str, Any]) -> str:
    grades, poses = counts["grades"], counts["poses"]
    rows = [(grade, count, _percent(count, poses)) for grade, count in grades.items()]
    return _table(("grade", "poses", "of all poses"), rows)


def _matching(matching: Mapping[str, Any] | None) -> str:
    if not matching or not matching["visible"]:
        return (
            "No photograph of the selection's runs is marked complete, so there is no table of "
            "association results."
        )
    rows = [
        (row["label"], row["count"], row["percent_of_visible"], row["paper_percent"])
        for row in matching["rows"]
    ]
    return (
        "## Association results\n\n"
        f"{matching['visible']} visible vessels on {matching['complete_images']} photographs that "
        "people marked complete. The paper's: 581 vessels on a sample of 500 photographs.\n\n"
        + _table(("", "vessels", "% of visible", "paper, %"), rows)
    )


def _registrations(registrations: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            each["id"],
            each["viewport_id"],
            each["method"],
            each["mae_px"],
            each["mae_pct_width"],
            each["mae_pct_height"],
        )
        for each in registrations
    ]
    rows.append(("paper", "", "pnp", 12.22, 0.48, 0.64))
    columns = ("registration", "viewport", "method", "mean error, px", "% of width", "% of height")
    return _table(columns, rows)


def _runs(runs: Sequence[Mapping[str, Any]]) -> str:
    columns = ("run", "preset", "detector", "detector SHA-256", "registration", "code")
    keys = ("id", "preset", "detector", "detector_sha256", "registration_id", "code_version")
    return _table(columns, [tuple(run[key] for key in keys) for run in runs])


def _recordings(files: Sequence[Mapping[str, Any]]) -> str:
    if not files:
        return "No recording of the sites overlaps the photographs' times."
    rows = [(each["id"], each["file_name"], each["sha256"]) for each in files]
    return "Recordings of the sites that overlap the photographs' times:\n\n" + _table(
        ("file", "name", "SHA-256"), rows
    )


def _percent(count: int, whole: int) -> str:
    return f"{100 * count / whole:.2f} %" if whole else ""


def _table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    head = ["| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)]
    body = ["| " + " | ".join(map(_text, row)) + " |" for row in rows]
    return "\n".join(head + body)


def _text(value: object) -> str:
    """Return a cell's text; a name from outside makes no markup of its own."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.2f}"
    text = str(value)
    for mark in "\\`*_[]<>|#":
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())
