"""Traffic of another make, quickly drawn: to see whether ways of matching hold elsewhere.

Nothing here is shared with the harbour: boxy hulls with a house and a mast, straight courses at any
angle, any camera height and field of view, AIS errors drawn straight onto the states and not what
the states say of themselves. Silhouettes are convex hulls painted from far to near, so that ships
hide one another; what a detector would suppress or overlook is left out. A convoy is seen as one
box, as one box per hull, or as both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from app.domain.arrays import FloatArray
from app.domain.camera import Camera, Intrinsics
from app.domain.detection import Detection
from app.domain.geodesy import EnuFrame, Geodetic
from app.domain.rotations import matrix_from_rotvec
from app.domain.sighting import SeenImage
from app.domain.vessel_state import VesselState

ORIGIN = Geodetic(51.9, 4.3, 43.0)
SIZE_PX = (1280, 960)
_KNOT_M_S = 1852 / 3600
_PAINT_SCALE = 0.5


@dataclass(frozen=True, slots=True)
class Rough:
    """What can be turned; shares are probabilities, sigmas one deviation."""

    camera_height_m: float = 28.0
    field_of_view_deg: float = 52.0
    nearest_m: float = 110.0
    farthest_m: float = 900.0
    vessels: float = 5.0  # in the image at a time, on average
    silent_share: float = 0.25
    convoy_share: float = 0.1
    bias_sigma_m: float = 4.0
    heading_sigma_deg: float = 2.0
    heading_bias_deg: float = 0.0
    wrong_size_share: float = 0.03
    camera_turn_deg: float = 0.0
    level_error_m: float = 0.3
    clock_s: float = 0.0
    miss_share: float = 0.06
    false_positives: float = 0.5
    edge_sigma_px: float = 1.5
    edge_sigma_share: float = 0.015
    gap_s: float = 55.0
    images: int = 32
    images_per_session: int = 8


@dataclass(frozen=True, eq=False)
class RoughImage:
    """An image as matching gets it, what each detection shows (None: nothing with AIS)."""

    seen: SeenImage
    shows: tuple[str | None, ...]
    matchable: frozenset[str]


@dataclass(frozen=True, eq=False)
class RoughTraffic:
    """A camera as registered, and its images."""

    camera: Camera
    frame: EnuFrame
    images: tuple[RoughImage, ...]


@dataclass(frozen=True, eq=False)
class _Hull:
    """One floating body: `ahead_m` is its middle's place along the unit it belongs to."""

    length_m: float
    width_m: float
    points_m: FloatArray  # (n, 3) forward, port, up
    ahead_m: float = 0.0


@dataclass(frozen=True, eq=False)
class _Ship:
    name: str
    silent: bool
    hulls: tuple[_Hull, ...]
    heading_deg: float
    speed_m_s: float
    place_m: FloatArray  # (2,) east, north in the session's middle
    bias_m: FloatArray
    heading_error_deg: float
    antenna: tuple[float, float]  # shares of length and width
    said_m: tuple[float, float]
    seen_as: str  # whole, parts, both
    moving_error_m_s: FloatArray = field(default_factory=lambda: np.zeros(2))

    def middle(self, time_s: float) -> FloatArray:
        """Return where it is, (2,) east and north."""
        return self.place_m + self.forward * self.speed_m_s * time_s

    @property
    def forward(self) -> FloatArray:
        """Return the unit vector of its course."""
        angle = np.radians(self.heading_deg)
        return np.array([np.sin(angle), np.cos(angle)])


def rough_traffic(seed: int, rough: Rough) -> RoughTraffic:
    """Draw all images of a camera; the same seed gives the same."""
    rng = np.random.default_rng([seed, 77])
    true_camera = _camera(rough)
    turn = rng.normal(0, 1, 3)
    turn *= np.radians(rough.camera_turn_deg) / np.linalg.norm(turn)
    registered = Camera(
        true_camera.intrinsics,
        matrix_from_rotvec(turn) @ true_camera.R_cam_from_world,
        true_camera.center_in_world,
    )
    frame = EnuFrame(ORIGIN)
    images: list[RoughImage] = []
    while len(images) < rough.images:
        count = min(rough.images_per_session, rough.images - len(images))
        span_s = (count - 1) * rough.gap_s
        ships = _fleet(rng, rough, span_s, len(images))
        start_s = 1.7e9 + 7200.0 * (len(images) // rough.images_per_session)
        for number in range(count):
            at_s = number * rough.gap_s - span_s / 2
            images.append(_image(rng, rough, true_camera, frame, ships, at_s, start_s + at_s))
    return RoughTraffic(registered, frame, tuple(images))


def _camera(rough: Rough) -> Camera:
    width, height = SIZE_PX
    focal = width / 2 / np.tan(np.radians(rough.field_of_view_deg) / 2)
    K = np.array([[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1]])
    # The horizon a quarter of the image below its upper edge.
    tilt = np.arctan(height * 0.25 / focal)
    right, forward = np.array([1.0, 0, 0]), np.array([0, np.cos(tilt), -np.sin(tilt)])
    R = np.array([right, np.cross(forward, right), forward])
    return Camera(Intrinsics(width, height, K), R, np.array([0, 0, rough.camera_height_m]))


def _fleet(rng: np.random.Generator, rough: Rough, span_s: float, first: int) -> list[_Ship]:
    """Draw ships that are in view at some moment of a session."""
    half = np.tan(np.radians(rough.field_of_view_deg) / 2)
    # A ship crosses the middle of the view in about this time.
    stay_s = 2 * half * (rough.nearest_m + rough.farthest_m) / 2 / 4.0
    count = int(np.ceil(rough.vessels * max(1.0, (span_s + stay_s) / stay_s)))
    ships: list[_Ship] = []
    for number in range(count):
        away = rough.nearest_m * (rough.farthest_m / rough.nearest_m) ** rng.uniform()
        here = np.array([rng.uniform(-half, half) * away, away])
        heading = rng.choice([90.0, 270.0]) + rng.normal(0, 25) if rng.random() < 0.8 else None
        heading = float(rng.uniform(0, 360)) if heading is None else float(heading)
        hulls = _convoy(rng) if rng.random() < rough.convoy_share else (_hull(rng),)
        speed = float(rng.uniform(1.5, 6.5)) if rng.random() < 0.85 else 0.0
        angle = np.radians(heading)
        moment = rng.uniform(-span_s / 2, span_s / 2)
        place = here - speed * moment * np.array([np.sin(angle), np.cos(angle)])
        length, width = _extent(hulls)
        wrong = rng.random() < rough.wrong_size_share
        factor = rng.uniform(0.5, 1.6) if wrong else 1.0
        ship = _Ship(
            name=str(244_000_000 + 1000 * first + number),
            silent=bool(rng.random() < rough.silent_share),
            hulls=hulls,
            heading_deg=heading,
            speed_m_s=speed,
            place_m=place,
            bias_m=rng.normal(0, rough.bias_sigma_m, 2),
            heading_error_deg=float(rng.normal(rough.heading_bias_deg, rough.heading_sigma_deg)),
            # That of a convoy is on its pusher, the last hull.
            antenna=(
                float(rng.uniform(0.15, 0.85))
                if len(hulls) == 1
                else 1 - float(rng.uniform(0.3, 0.7)) * hulls[0].length_m / length,
                float(rng.uniform(0.3, 0.7)),
            ),
            said_m=(float(round(length * factor)), float(round(width * factor))),
            seen_as=str(rng.choice(["whole", "parts", "both"], p=[0.5, 0.25, 0.25])),
        )
        if all(_apart(ship, other, span_s) for other in ships):
            ships.append(ship)
    return ships


def _apart(one: _Ship, other: _Ship, span_s: float) -> bool:
    """Whether two ships never come through one another."""
    times = np.linspace(-span_s / 2, span_s / 2, 15)
    gap = np.array([one.middle(t) - other.middle(t) for t in times])
    reach = (_extent(one.hulls)[0] + _extent(other.hulls)[0]) / 2
    along = np.abs(gap @ one.forward)
    aside = np.abs(gap @ np.array([one.forward[1], -one.forward[0]]))
    return not ((along < reach + 10) & (aside < 25)).any()


def _extent(hulls: Sequence[_Hull]) -> tuple[float, float]:
    low = min(h.ahead_m - h.length_m / 2 for h in hulls)
    high = max(h.ahead_m + h.length_m / 2 for h in hulls)
    return high - low, max(h.width_m for h in hulls)


def _hull(rng: np.random.Generator, length_m: float | None = None, ahead_m: float = 0.0) -> _Hull:
    """Draw a boxy hull with a flare, a house somewhere and a mast on it."""
    length = float(np.exp(rng.uniform(np.log(9), np.log(140)))) if length_m is None else length_m
    width = length * float(rng.uniform(0.12, 0.3)) if length < 60 else length * 0.13
    board = float(rng.uniform(0.02, 0.06)) * length + 0.8
    house = board + float(rng.uniform(2.0, 4.0)) + 0.05 * length
    mast = house + float(rng.uniform(1.0, 5.0))
    bow = float(rng.uniform(0.55, 0.95))
    plan = np.array([(0.5, 0.0), (bow / 2, 0.5), (bow / 2, -0.5), (-0.48, 0.45), (-0.48, -0.45)])
    flat = plan * (length, width)
    where, long = rng.uniform(-0.35, 0.2) * length, length * rng.uniform(0.1, 0.3)
    block = np.array([(a, b) for a in (-long / 2, long / 2) for b in (-width * 0.4, width * 0.4)])
    block[:, 0] += where
    points = [(*p, 0.0) for p in flat * 0.97] + [(*p, board) for p in flat]
    points += [(*p, house) for p in block] + [(float(where), 0.0, mast)]
    return _Hull(length, width, np.array(points), ahead_m)


def _convoy(rng: np.random.Generator) -> tuple[_Hull, ...]:
    """Draw a pusher with one to three barges ahead."""
    pusher = _hull(rng, float(rng.uniform(16, 26)))
    hulls, ahead = [pusher], pusher.length_m / 2
    for _ in range(int(rng.integers(1, 4))):
        length = float(rng.uniform(30, 60))
        flat = np.array([(a, b) for a in (-length / 2, length / 2) for b in (-4.5, 4.5)])
        points = [(*p, z) for p in flat for z in (0.0, float(rng.uniform(1.0, 3.0)))]
        hulls.append(_Hull(length, 9.0, np.array(points), ahead + length / 2 + 0.5))
        ahead += length + 0.5
    middle = (ahead - pusher.length_m / 2) / 2
    return tuple(_Hull(h.length_m, h.width_m, h.points_m, h.ahead_m - middle) for h in hulls)


@dataclass(frozen=True, eq=False)
class _Seen:
    ship: _Ship
    number: int
    outline_px: FloatArray
    distance_m: float


def _image(
    rng: np.random.Generator,
    rough: Rough,
    camera: Camera,
    frame: EnuFrame,
    ships: Sequence[_Ship],
    time_s: float,
    at_s: float,
) -> RoughImage:
    bodies = sorted(_bodies(camera, ships, time_s), key=lambda one: -one.distance_m)
    width, height = (int(side * _PAINT_SCALE) for side in SIZE_PX)
    canvas = np.full((height, width), -1, dtype=np.int16)
    total = []
    for index, body in enumerate(bodies):
        outline = cv2.convexHull((body.outline_px * _PAINT_SCALE).round().astype(np.int32))
        cv2.fillConvexPoly(canvas, outline, index)
        total.append(max(1.0, cv2.contourArea(outline.astype(np.float32))))
    visible = np.bincount(canvas[canvas >= 0].ravel(), minlength=len(bodies))
    found: list[tuple[FloatArray, float, str | None]] = []
    matchable = set()
    for ship in ships:
        mine = [i for i, body in enumerate(bodies) if body.ship is ship]
        if not mine:
            continue
        share = sum(visible[i] for i in mine) / sum(total[i] for i in mine)
        whole = _bounds(canvas, mine, bodies)
        if whole is None:
            continue
        if not ship.silent and share >= 0.5:
            matchable.add(ship.name)
        name = None if ship.silent else ship.name
        # Of a convoy's single hulls, the pusher's box is the vessel with AIS, barges are not.
        if len(ship.hulls) == 1 or ship.seen_as != "parts":
            found.append((whole, share, name))
        if len(ship.hulls) > 1 and ship.seen_as != "whole":
            for i in mine:
                part = _bounds(canvas, [i], bodies)
                if part is not None:
                    pusher = name if bodies[i].number == 0 else None
                    found.append((part, visible[i] / total[i], pusher))
    shown = _detected(rng, rough, found)
    states = tuple(_state(rng, rough, frame, ship, time_s) for ship in ships if not ship.silent)
    seen = SeenImage(
        tuple(d for d, _ in shown), states, ORIGIN.height_m + rough.level_error_m, at_s
    )
    return RoughImage(seen, tuple(name for _, name in shown), frozenset(matchable))


def _bodies(camera: Camera, ships: Sequence[_Ship], time_s: float) -> Iterator[_Seen]:
    for ship in ships:
        forward = np.array([*ship.forward, 0.0])
        port = np.array([-forward[1], forward[0], 0.0])
        axes = np.array([forward, port, [0.0, 0.0, 1.0]])
        for number, hull in enumerate(ship.hulls):
            middle = np.array([*ship.middle(time_s), 0.0]) + hull.ahead_m * forward
            points = middle + hull.points_m @ axes
            if camera.to_cam(points)[:, 2].min() < 5:
                continue
            pixels = camera.project(points)
            low, high = pixels.min(axis=0), pixels.max(axis=0)
            if (high < 0).any() or low[0] > SIZE_PX[0] or low[1] > SIZE_PX[1]:
                continue
            yield _Seen(ship, number, pixels + 0.5, float(np.linalg.norm(middle)))


def _bounds(
    canvas: "np.ndarray[tuple[int, ...], np.dtype[np.int16]]",
    mine: Sequence[int],
    bodies: Sequence[_Seen],
) -> FloatArray | None:
    """Bound what is seen of bodies: exact where an edge is not hidden, else by painted pixels."""
    mask = np.isin(canvas, mine)
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if not len(columns):
        return None
    painted = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1]) / _PAINT_SCALE
    points = np.concatenate([bodies[i].outline_px for i in mine])
    exact = np.concatenate([points.min(axis=0), points.max(axis=0)])
    exact = np.clip(exact, 0, (*SIZE_PX, *SIZE_PX))
    return np.where(np.abs(painted - exact) < 4, exact, painted)


def _detected(
    rng: np.random.Generator, rough: Rough, found: Sequence[tuple[FloatArray, float, str | None]]
) -> list[tuple[Detection, str | None]]:
    boxes: list[tuple[Detection, str | None]] = []
    for box, share, name in found:
        size = box[2:] - box[:2]
        if share < 0.35 or size.max() < 10 or rng.random() < rough.miss_share:
            continue
        sigma = rough.edge_sigma_px + rough.edge_sigma_share * np.tile(size, 2)
        noisy = np.clip(box + rng.normal(0, 1, 4) * sigma, 0, (*SIZE_PX, *SIZE_PX))
        score = float(np.clip(rng.normal(0.75, 0.12), 0.27, 0.98))
        if noisy[2] - noisy[0] > 2 and noisy[3] - noisy[1] > 2:
            boxes.append((Detection(*map(float, noisy), score), name))
    for _ in range(rng.poisson(rough.false_positives)):
        x, y = rng.uniform(0, 0.92) * SIZE_PX[0], rng.uniform(0.24, 0.8) * SIZE_PX[1]
        w = rng.uniform(15, 130)
        h = w * rng.uniform(0.2, 0.7)
        boxes.append((Detection(x, y, x + w, y + h, float(rng.uniform(0.26, 0.7))), None))
    kept: list[tuple[Detection, str | None]] = []
    for box, name in sorted(boxes, key=lambda one: -one[0].score):
        if all(_iou(box, other) < 0.55 for other, _ in kept):
            kept.append((box, name))
    return kept


def _iou(a: Detection, b: Detection) -> float:
    wide = min(a.x2_px, b.x2_px) - max(a.x1_px, b.x1_px)
    high = min(a.y2_px, b.y2_px) - max(a.y1_px, b.y1_px)
    common = max(0.0, wide) * max(0.0, high)
    areas = [(d.x2_px - d.x1_px) * (d.y2_px - d.y1_px) for d in (a, b)]
    return common / (sum(areas) - common)


def _state(
    rng: np.random.Generator, rough: Rough, frame: EnuFrame, ship: _Ship, time_s: float
) -> VesselState:
    """Say what AIS says of a ship: its own word on how sure that is stays the usual one."""
    heading = ship.heading_deg + ship.heading_error_deg
    length, width = _extent(ship.hulls)
    said_long, said_wide = ship.said_m
    along, across = ship.antenna
    right = np.array([ship.forward[1], -ship.forward[0]])
    # The antenna's true place; what is said of the hull around it may be another size.
    antenna = (
        ship.middle(time_s + rough.clock_s)
        + ship.forward * length * (0.5 - along)
        + right * width * (across - 0.5)
    )
    place = frame.geodetic(np.array([*(antenna + ship.bias_m + rng.normal(0, 0.5, 2)), 0.0]))
    return VesselState(
        identifier=ship.name,
        lat_deg=place.lat_deg,
        lon_deg=place.lon_deg,
        heading_deg=heading % 360,
        speed_kn=ship.speed_m_s / _KNOT_M_S,
        age_s=0.0,
        to_bow_m=round(said_long * along),
        to_stern_m=said_long - round(said_long * along),
        to_port_m=round(said_wide * across),
        to_starboard_m=said_wide - round(said_wide * across),
    )
