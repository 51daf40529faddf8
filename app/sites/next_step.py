"""What to do next on a site, so that a newcomer is never left at a dead end."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.registration.overview import ViewportLine
from app.sites.repository import SiteCounts
from app.tables.sites import Camera, Site


@dataclass(frozen=True, slots=True)
class Step:
    """What is to be done, why, and where."""

    title: str
    why: str
    label: str
    href: str


def next_step(  # noqa: PLR0911  one answer for each thing that may be missing
    site: Site, counts: SiteCounts, cameras: Sequence[Camera], lines: Sequence[ViewportLine]
) -> Step | None:
    """Return the first thing that is missing for poses; None when there are runs already."""
    if not cameras:
        return Step(
            "Add a camera",
            "Its image size and intrinsics say how the world is projected onto its photographs.",
            "New camera",
            f"/sites/{site.id}/cameras/new",
        )
    if not lines:
        return Step(
            "Add a viewport",
            "A viewport is one pointing of a camera; keypoints and images belong to it.",
            "New viewport",
            f"/cameras/{cameras[0].id}/viewports/new",
        )
    if not any(line.registration for line in lines):
        first = lines[0]
        return Step(
            f"Register {first.viewport.name}",
            f"{first.readiness.next_step}. Then every pixel knows its place on the water.",
            "Open the viewport",
            f"/viewports/{first.viewport.id}",
        )
    if not counts.images:
        return Step(
            "Upload photographs",
            "A run works on the images of a viewport.",
            "Open the camera",
            f"/cameras/{cameras[0].id}",
        )
    if not counts.ais_files:
        return Step(
            "Import AIS",
            "Positions and sizes of the vessels come from AIS messages of the same time.",
            "Import a recording",
            "/ais",
        )
    ready = next((line for line in lines if line.readiness.word == "Ready"), None)
    if not counts.runs and ready is not None:
        return Step(
            "Start a run",
            "Detect the vessels, match them with AIS and build a 3D box for each match.",
            "New run",
            ready.readiness.href,
        )
    return None
