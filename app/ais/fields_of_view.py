"""What the cameras of a site look at, from above: a fan from each registered viewport's camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.paging import Paging
from app.registration import conversion
from app.registration import service as registration
from app.tables.sites import Site, Viewport

REACH_M = 3_000.0  # a ship fills a few pixels there
_RAYS = 9
_LEVEL = 0.05  # steeper than this a line of sight has no direction on a map
_ALL = Paging(limit=1000, after=None)


@dataclass(frozen=True, slots=True)
class SeenFrom:
    """A viewport with the camera of its registration in the site's frame."""

    viewport: Viewport
    camera: Camera
    frame: EnuFrame

    def fan(self, reach_m: float = REACH_M) -> list[tuple[float, float]]:
        """Return the camera's place and the far ends of its view, left to right: (lat, lon) deg.

        Empty where the camera looks straight up or down.
        """
        lens = self.camera.intrinsics
        u_px = np.linspace(-0.5, lens.width_px - 0.5, _RAYS)
        rays = self.camera.rays(np.column_stack([u_px, np.full(_RAYS, (lens.height_px - 1) / 2)]))
        flat = np.hypot(rays[:, 0], rays[:, 1])
        usable = rays[flat > _LEVEL]
        if len(usable) < 2:
            return []
        ends = usable * (reach_m / np.hypot(usable[:, 0], usable[:, 1]))[:, None]
        ends[:, 2] = 0.0
        centre = self.camera.center_in_world
        places = [self.frame.geodetic(point) for point in (centre, *(centre + ends))]
        return [(place.lat_deg, place.lon_deg) for place in places]


def seen_from(session: Session, site: Site) -> Sequence[SeenFrom]:
    """Return the registered viewports of a site; those with a homography only have no camera."""
    viewports, _ = registration.list_viewports(session, None, _ALL, site_id=site.id)
    current = registration.current_registrations(session, [viewport.id for viewport in viewports])
    frame = conversion.frame_of(site)
    found = []
    for viewport in viewports:
        solved = current.get(viewport.id)
        camera = conversion.camera_of(solved, frame) if solved else None
        if camera is not None:
            found.append(SeenFrom(viewport, camera, frame))
    return found
