"""A harbour from a seed: site, camera, viewports, landmarks, vessels, AIS, images, truth.

`make_harbour` draws everything but the pixels, at once and in the same way for the same seed. An
image is rendered when asked for, and its truth comes from the same pixels. Frames do not depend on
one another: they can be rendered in any order, and in several processes that each make the same
harbour.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cached_property
from itertools import pairwise

import numpy as np

from app.domain.arrays import FloatArray, UInt8Array
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.simulation.detections import detect
from app.simulation.painter import Painter, ViewportScene
from app.simulation.scenery import build_scenery
from app.simulation.sessions import Session, capture_times_s, make_sessions, tide_m
from app.simulation.settings import DetectorSettings, HarbourSettings
from app.simulation.stage import Moment, Stage
from app.simulation.transmissions import Transmission, hear_vessel
from app.simulation.truth import VesselTruth
from app.simulation.vessels import Vessel
from app.simulation.viewports import (
    Landmark,
    Viewport,
    click_keypoints,
    looking,
    make_intrinsics,
)

DEFAULT_START = datetime(2026, 5, 12, 6, 10, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class SimulatedSite:
    """A place: `origin` of its ENU frame lies on the mean water level."""

    name: str
    origin: Geodetic
    water_level_m: float
    timezone: str


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
    """One image to be taken; `image_id` counts from 1, `name` is a file name with the UTC time."""

    image_id: int
    name: str
    captured_at: datetime
    viewport: Viewport
    _seed: int = field(repr=False)
    _detector: DetectorSettings = field(repr=False)
    _moment: Moment = field(repr=False)
    _stage: Stage = field(repr=False)

    @property
    def session(self) -> Session:
        """The session it belongs to, with weather and traffic."""
        return self._moment.session

    @property
    def water_level_m(self) -> float:
        """True water level above the site's, metres: the tide."""
        return self._moment.water_level_m

    @cached_property
    def truth(self) -> tuple[VesselTruth, ...]:
        """Every vessel that reaches into the image, hidden or not."""
        return self._stage.truths(self._moment, self._stage.cast(self._moment))

    @cached_property
    def detections(self) -> tuple[Detection, ...]:
        """What a detector of the set quality finds, best first."""
        inner = self.viewport.camera.intrinsics
        rng = np.random.default_rng([self._seed, 21, self.image_id])
        return detect(rng, self._detector, self.truth, (inner.width_px, inner.height_px))

    def render(self) -> UInt8Array:
        """Return the image (height, width, 3), BGR."""
        return self._stage.paint(self._moment, self._stage.cast(self._moment))

    def observe(self) -> Observation:
        """Return image, truth and detections, cheaper together than one by one."""
        cast = self._stage.cast(self._moment)
        self.__dict__["truth"] = self._stage.truths(self._moment, cast)  # where the cache looks
        return Observation(self._stage.paint(self._moment, cast), self.truth, self.detections)


@dataclass(frozen=True, eq=False)
class Harbour:
    """Everything there is to know about a simulated harbour.

    `frame` is the ENU frame at the site's origin in which viewports and truth are given.
    """

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
    sessions = make_sessions(seed, settings, azimuth_deg, image_count)
    cameras = _pointings(rng, azimuth_deg, width_px, height_px)[: sessions[-1].viewport + 1]
    scenes = tuple(ViewportScene.of(camera, scenery.mesh) for camera in cameras)
    viewports = _viewports(seed, start, settings, sessions, scenes, scenery.landmarks)
    stage = Stage(start, enu, Painter(seed), scenes)
    return Harbour(
        seed=seed,
        start=start,
        settings=settings,
        site=site,
        frame=enu,
        cameras=(
            SimulatedCamera(
                "Gable camera",
                enu.geodetic(cameras[0].center_in_world),
                cameras[0].intrinsics,
                viewports,
            ),
        ),
        landmarks=tuple(Landmark(n, enu.geodetic(p)) for n, p in scenery.landmarks.items()),
        sessions=sessions,
        frames=tuple(_frames(seed, settings, stage, sessions, viewports)),
        transmissions=_heard(seed, settings, enu, start, sessions),
    )


def _site(rng: np.random.Generator) -> SimulatedSite:
    """Somewhere on a made-up river near the North Sea."""
    level = round(float(rng.uniform(38.0, 43.0)), 2)
    place = Geodetic(
        round(float(rng.uniform(53.4, 54.2)), 6), round(float(rng.uniform(8.2, 10.2)), 6), level
    )
    return SimulatedSite("Demo harbour", place, level, "Europe/Berlin")


def _pointings(
    rng: np.random.Generator, azimuth_deg: float, width_px: int, height_px: int
) -> tuple[Camera, Camera]:
    """Return the true cameras: the second is the first, turned by a few degrees."""
    intrinsics = make_intrinsics(rng, width_px, height_px)
    center = np.array([0.0, 0.0, float(rng.uniform(26.0, 30.0))])
    tilt, roll = float(rng.uniform(8.8, 9.8)), float(rng.normal(0.0, 0.4))
    first = looking(intrinsics, center, azimuth_deg + float(rng.normal(0.0, 0.6)), tilt, roll)
    pan = float(rng.choice([-1, 1])) * float(rng.uniform(2.0, 4.5))
    lower = tilt + float(rng.uniform(-0.8, 0.8))
    second = looking(intrinsics, center, azimuth_deg + pan, lower, roll + float(rng.normal(0, 0.3)))
    return first, second


def _viewports(
    seed: int,
    start: datetime,
    settings: HarbourSettings,
    sessions: tuple[Session, ...],
    scenes: tuple[ViewportScene, ...],
    landmarks_in_enu: dict[str, FloatArray],
) -> tuple[Viewport, ...]:
    """Name the pointings and click their keypoints; the camera was turned between two sessions."""
    borders = [start - timedelta(days=1)]
    for before, after in pairwise(sessions):
        if before.viewport != after.viewport:
            borders.append(start + timedelta(seconds=(before.span_s[1] + after.span_s[0]) / 2))
    viewports = []
    for number, scene in enumerate(scenes):
        rng = np.random.default_rng([seed, 3, number])
        keypoints = click_keypoints(rng, scene, landmarks_in_enu, settings.click_sigma_px)
        ends = borders[number + 1] if number + 1 < len(borders) else None
        name = f"View {number + 1}"
        viewports.append(Viewport(name, borders[number], ends, scene.camera, keypoints))
    return tuple(viewports)


def _frames(
    seed: int,
    settings: HarbourSettings,
    stage: Stage,
    sessions: tuple[Session, ...],
    viewports: tuple[Viewport, ...],
) -> Iterator[Frame]:
    rng = np.random.default_rng([seed, 6])
    image_id = 0
    for session in sessions:
        viewport = viewports[session.viewport]
        for time_s in capture_times_s(rng, session, viewport.camera):
            image_id += 1
            captured_at = stage.start + timedelta(seconds=time_s)
            name = f"harbour_{captured_at:%Y%m%dT%H%M%S}_{image_id:04d}.jpg"
            moment = Moment(session, time_s, tide_m(seed, settings, time_s))
            yield Frame(
                image_id, name, captured_at, viewport, seed, settings.detector, moment, stage
            )


def _heard(
    seed: int,
    settings: HarbourSettings,
    enu: EnuFrame,
    start: datetime,
    sessions: tuple[Session, ...],
) -> tuple[Transmission, ...]:
    """Return what the receiver heard in all sessions, in order of arrival."""
    heard: list[Transmission] = []
    for session in sessions:
        span = (session.span_s[0] - settings.traffic.lead_in_s, session.span_s[1] + 60.0)
        for number, vessel in enumerate(session.vessels):
            rng = np.random.default_rng([seed, 8, session.number, number])
            heard += hear_vessel(rng, settings.traffic, enu, start, vessel, span)
    return tuple(sorted(heard, key=lambda t: t.heard_at))
