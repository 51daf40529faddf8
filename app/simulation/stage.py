"""From a moment to its pixels and its truth.

The stage keeps what all images of a harbour share. For one moment it puts every vessel on the
water, finds which of their pixels can be seen, and hands these on to both the painter and the
truth: what is shown and what is said to be shown are the same pixels.
"""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import TypeAlias

import numpy as np

from app.domain.arrays import UInt8Array
from app.domain.camera import Camera
from app.domain.geodesy import EnuFrame
from app.simulation.fleet_view import HullView, view_hulls
from app.simulation.light import Light, light_at
from app.simulation.motion import heading_axes
from app.simulation.painter import Painter, PlacedHull, ViewportScene, samples_per_px
from app.simulation.sessions import Session
from app.simulation.truth import PlacedVessel, VesselTruth, vessel_truths
from app.simulation.wakes import Wake

_NEAREST_M, _FARTHEST_M = 40.0, 4000.0

Cast: TypeAlias = list[tuple[PlacedVessel, list[HullView]]]


@dataclass(frozen=True, eq=False)
class Moment:
    """When in which session, seconds after the start, and the water level above its mean."""

    session: Session
    time_s: float
    water_level_m: float


@dataclass(eq=False)
class Stage:
    """What images need to be rendered; kept once for all of them."""

    start: datetime
    enu: EnuFrame
    painter: Painter
    scenes: tuple[ViewportScene, ...]
    _lights: dict[int, Light] = field(default_factory=dict)

    def cast(self, moment: Moment) -> Cast:
        """Vessels that can reach into the image, each with the pixels of its hulls."""
        scene = self.scenes[moment.session.viewport]
        near = [p for p in self._placed(moment) if _may_be_seen(scene.camera, p)]
        meshes = [
            part.mesh.moved(p.R_enu_from_vessel, p.middle_in_enu_m)
            for p in near
            for part in p.vessel.ship.parts
        ]
        per_px = samples_per_px(scene.camera.intrinsics.width_px)
        land = scene.backdrop.inverse_depth_above(moment.water_level_m)
        views = iter(view_hulls(scene.camera, meshes, per_px, land))
        return [(p, [next(views) for _ in p.vessel.ship.parts]) for p in near]

    def truths(self, moment: Moment, cast: Cast) -> tuple[VesselTruth, ...]:
        """Truth of every vessel that reaches into the image."""
        camera = self.scenes[moment.session.viewport].camera
        return tuple(t for placed, views in cast for t in vessel_truths(camera, placed, views))

    def paint(self, moment: Moment, cast: Cast) -> UInt8Array:
        """Return the image (height, width, 3), BGR."""
        scene = self.scenes[moment.session.viewport]
        hulls, views = [], []
        for placed, parts in cast:
            away = placed.middle_in_enu_m - scene.camera.center_in_world
            for number, view in enumerate(parts):
                wake = None if number else _wake(placed)
                hulls.append(
                    PlacedHull(
                        view.mesh,
                        float(np.linalg.norm(away)),
                        placed.R_enu_from_vessel,
                        placed.middle_in_enu_m,
                        wake,
                    )
                )
                views.append(view)
        light = self._light(moment.session)
        levels = (moment.water_level_m, moment.session.water_level_m)
        return self.painter.paint(scene, light, levels, moment.time_s, hulls, views)

    def _light(self, session: Session) -> Light:
        """One light a session: the sun moves two degrees in its minutes."""
        if session.number not in self._lights:
            middle = self.start + timedelta(seconds=sum(session.span_s) / 2)
            self._lights[session.number] = light_at(self.enu.origin, middle, session.weather)
        return self._lights[session.number]

    def _placed(self, moment: Moment) -> list[PlacedVessel]:
        """All vessels of the session, standing on the water of the moment."""
        level = self.enu.origin.height_m + moment.water_level_m
        placed = []
        for vessel in moment.session.vessels:
            motion = vessel.passage.at(moment.time_s)
            place = self.enu.geodetic((motion.east_m, motion.north_m, 0.0))
            axes = self.enu.axes(place.lat_deg, place.lon_deg)
            placed.append(
                PlacedVessel(
                    vessel,
                    self.enu.position(place.lat_deg, place.lon_deg, level),
                    heading_axes(motion.heading_deg, axes),
                    motion.heading_deg,
                    motion.speed_m_s,
                )
            )
        return placed


def _may_be_seen(camera: Camera, placed: PlacedVessel) -> bool:
    """Whether a vessel is in front of the camera and not far outside its image."""
    right, _, ahead = camera.to_cam(placed.middle_in_enu_m)[0]
    inner = camera.intrinsics
    half = max(inner.width_px, inner.height_px) / float(inner.K[0, 0]) * 0.6
    aside = abs(right) - placed.vessel.ship.length_m
    return bool(_NEAREST_M < ahead < _FARTHEST_M and aside < half * ahead)


def _wake(placed: PlacedVessel) -> Wake | None:
    if placed.speed_m_s < 0.5:
        return None
    ahead, middle, ship = placed.R_enu_from_vessel[:, 0], placed.middle_in_enu_m, placed.vessel.ship
    return Wake(
        (float(middle[0]), float(middle[1])),
        (float(ahead[0]), float(ahead[1])),
        ship.length_m,
        ship.width_m,
        placed.speed_m_s,
    )
