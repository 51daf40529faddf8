"""Keypoints: landmarks with the pixels at which they are seen, and whether they can carry a camera.

Registration is only as good as the spread of its keypoints. Too few, or all on one line, leave the
camera free to swing around: that is refused. All far away, on one side of the image or nearly on a
line is poor but possible: that is said before anybody trusts the result.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from app.domain.arrays import FloatArray
from app.domain.camera import Intrinsics
from app.domain.geodesy import Geodetic, WorldFrame

RECOMMENDED_POINTS = 10
_ON_A_LINE = 5e-4  # of the points' extent; measured: the camera is off by 10 m and more
_NEARLY_ON_A_LINE = 0.05


class SuspicionKind(StrEnum):
    """What seems to be wrong with keypoints."""

    SWAPPED = "swapped"  # two landmarks, each seen where the other should be
    MISPLACED = "misplaced"  # seen where another landmark should be
    HEIGHT = "height"  # fits with another height
    OUTLIER = "outlier"  # does not agree, for no reason that could be found
    MIRRORED_HEIGHTS = "mirrored_heights"
    MIRRORED_ROWS = "mirrored_rows"  # v counted from below
    FOCAL_LENGTH = "focal_length"


@dataclass(frozen=True, slots=True)
class Suspicion:
    """A likely mistake: of which keypoints (by index; none: of all), and in words what to do."""

    kind: SuspicionKind
    indices: tuple[int, ...]
    message: str


class RegistrationError(ValueError):
    """Keypoints that cannot carry a camera: the message gives the reason and the fix."""

    def __init__(self, reason: str, suspicions: Sequence[Suspicion] = ()) -> None:
        hints = [suspicion.message.rstrip(".") for suspicion in suspicions]
        super().__init__(". ".join([reason, *hints]))
        self.suspicions = tuple(suspicions)


@dataclass(frozen=True, eq=False)
class Keypoints:
    """Landmarks in the world frame (n, 3), metres, and where they are seen, pixels (n, 2).

    `names` are what messages call them; numbers from 1 where there are none. Raises
    RegistrationError when the arrays do not fit together or hold what is no number.
    """

    points_in_world: FloatArray
    pixels_px: FloatArray
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        points = np.array(self.points_in_world, dtype=np.float64).reshape(-1, 3)
        pixels = np.array(self.pixels_px, dtype=np.float64).reshape(-1, 2)
        if len(points) != len(pixels):
            raise RegistrationError(
                f"{len(points)} landmarks but {len(pixels)} pixels: give each landmark its pixel"
            )
        broken = ~(np.isfinite(points).all(axis=1) & np.isfinite(pixels).all(axis=1))
        if broken.any():
            raise RegistrationError(
                f"keypoint {self.label(int(np.flatnonzero(broken)[0]))} has a coordinate that is "
                "no finite number: correct or remove it"
            )
        if self.names and len(self.names) != len(points):
            raise RegistrationError(f"{len(points)} landmarks but {len(self.names)} names")
        object.__setattr__(self, "points_in_world", points)
        object.__setattr__(self, "pixels_px", pixels)

    def __len__(self) -> int:
        return len(self.points_in_world)

    def __getitem__(self, chosen: npt.NDArray[np.bool_]) -> "Keypoints":
        names = tuple(np.array(self.names, dtype=object)[chosen]) if self.names else ()
        return Keypoints(self.points_in_world[chosen], self.pixels_px[chosen], names)

    def label(self, index: int) -> str:
        """Return what a message calls a keypoint."""
        return repr(self.names[index]) if self.names else f"number {index + 1}"

    def without(self, index: int) -> "Keypoints":
        """Leave one keypoint out."""
        return self[np.arange(len(self)) != index]


def keypoints_in(
    frame: WorldFrame,
    seen: Iterable[tuple[Geodetic, tuple[float, float]]],
    names: Sequence[str] = (),
) -> Keypoints:
    """Place landmarks, each with its pixel (u, v), in a world frame."""
    pairs = list(seen)
    points = [frame.position(g.lat_deg, g.lon_deg, g.height_m) for g, _ in pairs]
    return Keypoints(np.array(points), np.array([pixel for _, pixel in pairs]), tuple(names))


def require_usable(keypoints: Keypoints, minimum: int) -> None:
    """Refuse, with the reason and the fix, keypoints that cannot carry a camera.

    Raises RegistrationError for fewer than `minimum` different keypoints, and for landmarks on one
    straight line, in the world or in the image.
    """
    different = len(np.unique(keypoints.points_in_world.round(3), axis=0))
    if different < minimum:
        raise RegistrationError(
            f"{different} different landmarks are too few: registration needs {minimum}, "
            f"and is good from {RECOMMENDED_POINTS}; mark more landmarks"
        )
    for name, coordinates in (
        ("landmarks", keypoints.points_in_world),
        ("pixels", keypoints.pixels_px),
    ):
        if line_share(coordinates) < _ON_A_LINE:
            raise RegistrationError(
                f"all {name} lie on one straight line, about which the camera could turn freely; "
                "mark landmarks beside that line"
            )


def spread_warnings(keypoints: Keypoints, image: Intrinsics) -> list[str]:
    """Say, before solving, what is poor about the keypoints' number and spread."""
    warnings = []
    if len(keypoints) < RECOMMENDED_POINTS:
        warnings.append(
            f"Only {len(keypoints)} keypoints: {RECOMMENDED_POINTS} or more make the camera "
            "several times surer."
        )
    if line_share(keypoints.points_in_world) < _NEARLY_ON_A_LINE:
        warnings.append("The landmarks lie nearly on one line: add some beside it.")
    u, v = keypoints.pixels_px.T
    for values, size, sides in (
        (u, image.width_px, ("left", "right")),
        (v, image.height_px, ("upper", "lower")),
    ):
        if np.ptp(values) < size / 3:
            # Where the empty part is larger, new keypoints help most.
            empty = sides[0] if values.mean() > size / 2 else sides[1]
            warnings.append(
                f"The keypoints cover less than a third of the image's "
                f"{'width' if size == image.width_px else 'height'}: add some in its {empty} part."
            )
    return warnings


def depth_warning(depths_m: FloatArray) -> str | None:
    """Warn when all landmarks are about equally far (n,), so that none of them is near."""
    if depths_m.min() > depths_m.max() / 2:
        return (
            f"All landmarks are far ({depths_m.min():.0f} to {depths_m.max():.0f} m): "
            "one at less than half that distance makes the camera's place much surer."
        )
    return None


def line_share(coordinates: FloatArray) -> float:
    """Extent across the best line through points (n, d), as a share of the extent along it."""
    extents = np.linalg.svd(coordinates - coordinates.mean(axis=0), compute_uv=False)
    return float(extents[1] / extents[0]) if extents[0] > 0 else 0.0
