"""A harbour from a seed: site, camera, viewports, landmarks, vessels, AIS, images, truth.

`make_harbour` draws everything but the pixels, at once and in the same way for the same seed. An
image is rendered when asked for, and its truth comes from the same pixels. Images are taken in
sessions at several hours of the day, each with its weather, when vessels are in view, as cameras
with a motion trigger do.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cached_property

import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.simulation.detections import CocoResult, coco_results, detect
from app.simulation.fleet_view import HullView, view_hulls
from app.simulation.light import WEATHERS, Light, Weather, light_at
from app.simulation.motion import heading_axes
from app.simulation.painter import Painter, PlacedHull, ViewportScene, samples_per_px
from app.simulation.scenery import Scenery, build_scenery, harbour_axes
from app.simulation.settings import HarbourSettings
from app.simulation.ship_plans import Fleet
from app.simulation.traffic import make_vessels
from app.simulation.transmissions import Transmission, hear_vessel
from app.simulation.truth import PlacedVessel, VesselTruth, vessel_truths
from app.simulation.vessels import Vessel
from app.simulation.viewports import (
    Landmark,
    Viewport,
    click_keypoints,
    looking,
    make_intrinsics,
)
from app.simulation.wakes import Wake

DEFAULT_START = datetime(2026, 5, 12, 6, 10, tzinfo=UTC)
_SESSION_HOURS = (0.0, 5.4, 10.6)  # after the start, each day
_SECONDS_PER_IMAGE = 50.0
_TIDE_S = 12.42 * 3600


@dataclass(frozen=True, slots=True)
class SimulatedSite:
    """A place: `origin` of its ENU frame lies on the mean water level."""

    name: str
    origin: Geodetic
    water_level_m: float
    timezone: str


@dataclass(frozen=True, eq=False)
class Session:
    """Some minutes in which images are taken: seconds after the start, weather and traffic."""

    number: int
    span_s: tuple[float, float]
    viewport: int
    weather: Weather
    vessels: tuple[Vessel, ...]


@dataclass(frozen=True, eq=False)
class SimulatedCamera:
    """One camera: where it stands, its lens, and its pointings in order of time."""

    name: str
    place: Geodetic
    intrinsics: Intrinsics
    viewports: tuple[Viewport, ...]


@dataclass(frozen=True, eq=False)
class Observation:
    """One image (height, width, 3) BGR, the truth of all vessels in it, and detections."""

    image: UInt8Array
    truth: tuple[VesselTruth, ...]
    detections: tuple[Detection, ...]


@dataclass(frozen=True, eq=False)
class Frame:
    """One image to be taken: `image_id` counts from 1."""

    image_id: int
    name: str
    captured_at: datetime
    viewport: Viewport
    water_level_m: float
    session: Session
    _stage: "_Stage" = field(repr=False)

    @property
    def time_s(self) -> float:
        """Seconds after the harbour's start."""
        return (self.captured_at - self._stage.start).total_seconds()

    @cached_property
    def truth(self) -> tuple[VesselTruth, ...]:
        """Every vessel that reaches into the image, hidden or not."""
        return self._stage.truths(self, self._stage.views(self))

    @cached_property
    def detections(self) -> tuple[Detection, ...]:
        """What a detector of the set quality finds."""
        return self._stage.detections(self)

    def render(self) -> UInt8Array:
        """Return the image (height, width, 3), BGR."""
        return self._stage.paint(self, self._stage.views(self))

    def observe(self) -> Observation:
        """Return image, truth and detections, cheaper together than one by one."""
        views = self._stage.views(self)
        self.__dict__["truth"] = self._stage.truths(self, views)
        return Observation(self._stage.paint(self, views), self.truth, self.detections)


@dataclass(frozen=True, eq=False)
class Harbour:
    """Everything there is to know about a simulated harbour."""

    seed: int
    start: datetime
    settings: HarbourSettings
    site: SimulatedSite
    frame: EnuFrame
    cameras: tuple[SimulatedCamera, ...]
    landmarks: tuple[Landmark, ...]
    sessions: tuple[Session, ...]
    frames: tuple[Frame, ...]
    transmissions: tuple[Transmission, ...]

    @property
    def camera(self) -> SimulatedCamera:
        """The harbour's only camera."""
        return self.cameras[0]

    @property
    def vessels(self) -> tuple[Vessel, ...]:
        """All vessels of all sessions."""
        return tuple(vessel for session in self.sessions for vessel in session.vessels)

    def nmea_lines(self) -> Iterator[str]:
        """Yield the AIS recording line by line, in order of arrival."""
        for transmission in self.transmissions:
            yield from transmission.lines

    def nmea_text(self) -> str:
        """Return the AIS recording as one text with a line break after each line."""
        return "".join(f"{line}\n" for line in self.nmea_lines())

    def coco_results(self) -> list[CocoResult]:
        """Return the simulated detections of all images as a COCO results list."""
        return coco_results((frame.image_id, frame.detections) for frame in self.frames)


@dataclass(eq=False)
class _Stage:
    """What frames need to be rendered; kept once for all of them."""

    seed: int
    start: datetime
    settings: HarbourSettings
    enu: EnuFrame
    scenery: Scenery
    painter: Painter
    scenes: list[ViewportScene]
    _lights: dict[int, Light] = field(default_factory=dict)

    def scene(self, frame: Frame) -> ViewportScene:
        return self.scenes[frame.session.viewport]

    def light(self, session: Session) -> Light:
        """One light a session: the sun moves two degrees in its minutes."""
        if session.number not in self._lights:
            middle = self.start + timedelta(seconds=sum(session.span_s) / 2)
            self._lights[session.number] = light_at(self.enu.origin, middle, session.weather)
        return self._lights[session.number]

    def placed(self, frame: Frame) -> list[PlacedVessel]:
        """All vessels of the session where they are at the frame's time."""
        level = self.enu.origin.height_m + frame.water_level_m
        placed = []
        for vessel in frame.session.vessels:
            motion = vessel.passage.at(frame.time_s)
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

    def views(self, frame: Frame) -> list[tuple[PlacedVessel, list[HullView]]]:
        """Vessels that can reach into the image, each with the pixels of its hulls."""
        scene = self.scene(frame)
        near = [p for p in self.placed(frame) if _may_be_seen(scene.camera, p)]
        meshes = [
            part.mesh.moved(p.R_enu_from_vessel, p.middle_in_enu_m)
            for p in near
            for part in p.vessel.ship.parts
        ]
        per_px = samples_per_px(scene.camera.intrinsics.width_px)
        land = scene.backdrop.inverse_depth(frame.water_level_m)
        views = iter(view_hulls(scene.camera, meshes, per_px, land))
        return [(p, [next(views) for _ in p.vessel.ship.parts]) for p in near]

    def truths(
        self, frame: Frame, views: list[tuple[PlacedVessel, list[HullView]]]
    ) -> tuple[VesselTruth, ...]:
        camera = frame.viewport.camera
        return tuple(t for placed, parts in views for t in vessel_truths(camera, placed, parts))

    def detections(self, frame: Frame) -> tuple[Detection, ...]:
        inner = frame.viewport.camera.intrinsics
        rng = np.random.default_rng([self.seed, 21, frame.image_id])
        size = (inner.width_px, inner.height_px)
        return detect(rng, self.settings.detector, frame.truth, size)

    def paint(self, frame: Frame, views: list[tuple[PlacedVessel, list[HullView]]]) -> UInt8Array:
        scene = self.scene(frame)
        hulls, pixels = [], []
        for placed, parts in views:
            away = placed.middle_in_enu_m - scene.camera.center_in_world
            for number, view in enumerate(parts):
                wake = _wake(placed) if not number else None
                hulls.append(PlacedHull(view.mesh, float(np.linalg.norm(away)), wake))
                pixels.append(view)
        return self.painter.paint(
            scene, self.light(frame.session), frame.water_level_m, frame.time_s, hulls, pixels
        )


def make_harbour(
    seed: int,
    image_count: int = 24,
    width_px: int = 1280,
    height_px: int = 960,
    *,
    start: datetime = DEFAULT_START,
    settings: HarbourSettings | None = None,
) -> Harbour:
    """Make a harbour: the same arguments give the same harbour, to the last pixel and message.

    Args:
        seed: any number that is not negative.
        image_count: how many images are taken, at least 1.
        width_px: image width.
        height_px: image height.
        start: aware UTC moment to which all times relate.
        settings: what goes wrong, and how much.

    Raises:
        ValueError: naming the argument out of its range.

    """
    if seed < 0:
        raise ValueError(f"seed must not be negative, got {seed}")
    if image_count < 1:
        raise ValueError(f"image_count must be at least 1, got {image_count}")
    if start.utcoffset() != timedelta(0):
        raise ValueError("start must be an aware time in UTC")
    settings = settings or HarbourSettings()
    rng = np.random.default_rng([seed, 1])
    site = _site(rng)
    enu = EnuFrame(site.origin)
    azimuth_deg = float(rng.uniform(0, 360))
    scenery = build_scenery(np.random.default_rng([seed, 2]), azimuth_deg)
    spans = _session_spans(settings, image_count)
    cameras = _pointings(rng, azimuth_deg, width_px, height_px, count=min(2, len(spans)))
    scenes = [ViewportScene.of(camera, scenery.mesh) for camera in cameras]
    painter = Painter(seed)
    stage = _Stage(seed, start, settings, enu, scenery, painter, scenes)
    viewports = _viewports(seed, stage, spans)
    sessions = tuple(
        _session(seed, settings, azimuth_deg, number, span, len(viewports), len(spans))
        for number, span in enumerate(spans)
    )
    frames = _frames(seed, stage, sessions, viewports, image_count)
    camera = SimulatedCamera(
        "Gable camera", enu.geodetic(cameras[0].center_in_world), cameras[0].intrinsics, viewports
    )
    landmarks = tuple(Landmark(n, enu.geodetic(p)) for n, p in scenery.landmarks.items())
    heard = _heard(seed, settings, enu, start, sessions)
    return Harbour(seed, start, settings, site, enu, (camera,), landmarks, sessions, frames, heard)


def _site(rng: np.random.Generator) -> SimulatedSite:
    """Somewhere on a made-up river near the North Sea."""
    level = round(float(rng.uniform(38.0, 43.0)), 2)
    place = Geodetic(
        round(float(rng.uniform(53.4, 54.2)), 6), round(float(rng.uniform(8.2, 10.2)), 6), level
    )
    return SimulatedSite("Demo harbour", place, level, "Europe/Berlin")


def _session_spans(settings: HarbourSettings, image_count: int) -> list[tuple[float, float]]:
    """Cut the images into sessions of some minutes, three a day."""
    count = -(-image_count // settings.images_per_session)
    spans = []
    for number in range(count):
        day, hour = divmod(number, len(_SESSION_HOURS))
        first = day * 86400.0 + _SESSION_HOURS[hour] * 3600.0
        here = image_count // count + (number < image_count % count)
        spans.append((first, first + here * _SECONDS_PER_IMAGE))
    return spans


def _pointings(
    rng: np.random.Generator, azimuth_deg: float, width_px: int, height_px: int, count: int
) -> list[Camera]:
    """Return the true cameras: the second is the first, turned by a few degrees."""
    intrinsics = make_intrinsics(rng, width_px, height_px)
    center = np.array([0.0, 0.0, float(rng.uniform(26.0, 30.0))])
    tilt, roll = float(rng.uniform(8.8, 9.8)), float(rng.normal(0.0, 0.4))
    first = looking(intrinsics, center, azimuth_deg + float(rng.normal(0.0, 0.6)), tilt, roll)
    pan = float(rng.choice([-1, 1])) * float(rng.uniform(2.0, 4.5))
    lower = tilt + float(rng.uniform(-0.8, 0.8))
    second = looking(intrinsics, center, azimuth_deg + pan, lower, roll + float(rng.normal(0, 0.3)))
    return [first, second][:count]


def _viewports(seed: int, stage: _Stage, spans: list[tuple[float, float]]) -> tuple[Viewport, ...]:
    """Name the pointings and click their keypoints; the camera was turned between two sessions."""
    change = None
    if len(stage.scenes) > 1:
        half = (len(spans) + 1) // 2
        change = stage.start + timedelta(seconds=(spans[half - 1][1] + spans[half][0]) / 2)
    viewports = []
    for number, scene in enumerate(stage.scenes):
        rng = np.random.default_rng([seed, 3, number])
        keypoints = click_keypoints(
            rng, scene, stage.scenery.landmarks, stage.settings.click_sigma_px
        )
        begins = stage.start - timedelta(days=1) if not number or change is None else change
        ends = change if not number else None
        viewports.append(Viewport(f"View {number + 1}", begins, ends, scene.camera, keypoints))
    return tuple(viewports)


def _session(
    seed: int,
    settings: HarbourSettings,
    azimuth_deg: float,
    number: int,
    span_s: tuple[float, float],
    viewport_count: int,
    session_count: int,
) -> Session:
    rng = np.random.default_rng([seed, 4, number])
    order = np.random.default_rng([seed, 5]).permutation(len(WEATHERS))
    weather = WEATHERS[int(order[number % len(WEATHERS)])]
    vessels = make_vessels(
        rng, settings.traffic, Fleet(settings.fleet), harbour_axes(azimuth_deg), span_s,
        f"s{number + 1}", 211_200_000 + 1000 * number,
    )  # fmt: skip
    half = (session_count + 1) // 2
    viewport = 0 if number < half or viewport_count == 1 else 1
    return Session(number, span_s, viewport, weather, vessels)


def _frames(
    seed: int,
    stage: _Stage,
    sessions: tuple[Session, ...],
    viewports: tuple[Viewport, ...],
    image_count: int,
) -> tuple[Frame, ...]:
    """Choose when images are taken: once in each slot, when something is in view if ever."""
    frames: list[Frame] = []
    rng = np.random.default_rng([seed, 6])
    for session in sessions:
        slots = round((session.span_s[1] - session.span_s[0]) / _SECONDS_PER_IMAGE)
        for slot in range(slots):
            first = session.span_s[0] + slot * _SECONDS_PER_IMAGE
            times = first + np.arange(4.0, _SECONDS_PER_IMAGE, 3.0) + float(rng.uniform(-1, 1))
            camera = viewports[session.viewport].camera
            busy = [t for t in times if _in_view(camera, session, float(t))]
            time_s = round(float(rng.choice(busy or times)), 2)
            captured_at = stage.start + timedelta(seconds=time_s)
            number = len(frames) + 1
            frames.append(
                Frame(
                    number,
                    f"harbour_{captured_at:%Y%m%dT%H%M%S}_{number:04d}.jpg",
                    captured_at,
                    viewports[session.viewport],
                    _tide_m(seed, stage.settings, time_s),
                    session,
                    stage,
                )
            )
    return tuple(frames[:image_count])


def _tide_m(seed: int, settings: HarbourSettings, time_s: float) -> float:
    phase = float(np.random.default_rng([seed, 7]).uniform(0, 2 * np.pi))
    return settings.tide_amplitude_m * float(np.sin(2 * np.pi * time_s / _TIDE_S + phase))


def _in_view(camera: Camera, session: Session, time_s: float) -> bool:
    """Whether the middle of a moving vessel is in the image."""
    motions = [v.passage.at(time_s) for v in session.vessels if not v.moored]
    if not motions:
        return False
    pixels = camera.project(np.array([(m.east_m, m.north_m, 0.0) for m in motions]))
    inner = camera.intrinsics
    inside = (pixels >= 0) & (pixels < (inner.width_px, inner.height_px))
    return bool(inside.all(axis=1).any())


def _may_be_seen(camera: Camera, placed: PlacedVessel) -> bool:
    """Whether a vessel is in front of the camera and not far outside its image."""
    in_cam = camera.to_cam(placed.middle_in_enu_m)[0]
    reach = placed.vessel.ship.length_m
    inner = camera.intrinsics
    half = max(inner.width_px, inner.height_px) / float(inner.K[0, 0]) * 0.6
    return bool(in_cam[2] > 40 and abs(in_cam[0]) < half * in_cam[2] + reach and in_cam[2] < 4000)


def _wake(placed: PlacedVessel) -> Wake | None:
    if placed.speed_m_s < 0.5:
        return None
    ahead = placed.R_enu_from_vessel[:, 0]
    ship = placed.vessel.ship
    middle: FloatArray = placed.middle_in_enu_m
    return Wake(
        (float(middle[0]), float(middle[1])), (float(ahead[0]), float(ahead[1])),
        ship.length_m, ship.width_m, placed.speed_m_s,
    )  # fmt: skip


def _heard(
    seed: int,
    settings: HarbourSettings,
    enu: EnuFrame,
    start: datetime,
    sessions: tuple[Session, ...],
) -> tuple[Transmission, ...]:
    heard: list[Transmission] = []
    for session in sessions:
        span = (session.span_s[0] - settings.traffic.lead_in_s, session.span_s[1] + 60.0)
        for number, vessel in enumerate(session.vessels):
            rng = np.random.default_rng([seed, 8, session.number, number])
            heard += hear_vessel(rng, settings.traffic, enu, start, vessel, span)
    return tuple(sorted(heard, key=lambda t: t.heard_at))
