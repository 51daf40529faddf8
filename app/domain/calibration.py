"""A lens from photographs of a chequerboard: focal lengths, principal point and distortion.

A board of known squares, photographed from many sides, tells how a lens maps directions to pixels
(Zhang, 2000). What it cannot tell it must not pretend: boards all seen straight on leave the focal
length open, boards only in the middle leave the distortion open, one bent board spoils the rest.
So each photograph has its own error, and the solution says what it did not see.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from app.domain.arrays import Float32Array, FloatArray, UInt8Array
from app.domain.camera import Intrinsics

# OpenCV is imported where it is used: the web process shows results without it.

FEWEST_VIEWS = 3
GOOD_VIEWS = 10
LEAST_TILT_DEG = 10.0
GOOD_COVERAGE = 0.5
BLURRED_EDGE_PX = 6.0
SEARCH_WIDTH_PX = 1280
OUTLIER_RATIO = 3.0
OUTLIER_FLOOR_PX = 0.5
UNSURE_FOCAL = 0.01
WIDE_DEG = 70.0  # from here on the distortion's sixth power shows
_GRID = 64


@dataclass(frozen=True, slots=True)
class Board:
    """A chequerboard by its inner corners (where four squares meet) and its squares in metres."""

    columns: int
    rows: int
    square_m: float

    def corners_m(self) -> FloatArray:
        """Return the inner corners (n, 3) on the board's own plane, row by row, metres."""
        across, down = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        flat = np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)])
        return np.asarray(flat * self.square_m, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class CornerSearch:
    """The inner corners (n, 2) px found in a photograph, or why it is of no use."""

    corners_px: FloatArray | None
    problem: str | None = None


@dataclass(frozen=True, eq=False)
class LensSolution:
    """A lens with its doubts: `deviations` are of fx, fy, cx, cy (4,), px, one sigma.

    `view_rms_px` and `view_tilt_deg` are of each photograph; `coverage` is the share of the image
    that boards reached; `outliers` are the places of photographs whose error stands out.
    """

    intrinsics: Intrinsics
    rms_px: float
    view_rms_px: FloatArray
    view_tilt_deg: FloatArray
    deviations_px: FloatArray
    coverage: float
    outliers: tuple[int, ...]
    warnings: tuple[str, ...]


def find_corners(image: UInt8Array, board: Board) -> CornerSearch:
    """Find a board's inner corners in a photograph (height, width, 3), BGR, to a tenth of a pixel.

    The board is looked for in a smaller copy, where it is found fastest, and its corners are then
    placed in the photograph itself.
    """
    import cv2  # noqa: PLC0415 - see above

    grey: UInt8Array = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
    scale = min(1.0, SEARCH_WIDTH_PX / max(grey.shape))
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    pattern = (board.columns, board.rows)
    for flags in (
        cv2.CALIB_CB_NORMALIZE_IMAGE,
        cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE,
    ):
        found, corners = cv2.findChessboardCornersSB(small, pattern, flags=flags)
        if found:
            break
    else:
        return CornerSearch(
            None,
            f"no board of {board.columns} x {board.rows} inner corners found: the whole board must "
            "be seen, with a white rim, and the numbers count inner corners",
        )
    rough = (np.asarray(corners, np.float64).reshape(-1, 2) + 0.5) / scale - 0.5
    exact = _placed(grey, rough, board)
    edge_px = _edge_width_px(grey, exact, pattern)
    if edge_px > BLURRED_EDGE_PX:
        return CornerSearch(
            exact, f"blurred: edges are {edge_px:.0f} px wide; hold board and camera still"
        )
    return CornerSearch(exact)


def solve_lens(
    board: Board, views: Sequence[FloatArray], width_px: int, height_px: int
) -> LensSolution:
    """Solve a lens from the corners (n, 2) px seen in each photograph.

    Raises ValueError with the reason and the fix when they carry no lens.
    """
    import cv2  # noqa: PLC0415 - see above

    if len(views) < FEWEST_VIEWS:
        raise ValueError(
            f"{len(views)} usable photographs are too few: at least {FEWEST_VIEWS}, better "
            f"{GOOD_VIEWS} to 20, from different sides"
        )
    points = [board.corners_m().astype(np.float32)] * len(views)
    seen = [view.astype(np.float32).reshape(-1, 1, 2) for view in views]
    try:
        solved = _calibrate(points, seen, (width_px, height_px), cv2.CALIB_FIX_K3)
        if _field_of_view_deg(solved[1], width_px, height_px) > WIDE_DEG:
            solved = _calibrate(points, seen, (width_px, height_px), 0)
    except cv2.error as error:
        raise ValueError(
            "the photographs do not fit one lens; check the board's numbers and the camera"
        ) from error
    rms_px, K, distortion, turns, deviations, view_rms = solved
    _refuse_absurd(K, distortion, rms_px, width_px, height_px)
    tilts = np.array([_tilt_deg(turn) for turn in turns])
    outliers = _outliers(view_rms)
    coverage = covered_share(views, width_px, height_px)
    return LensSolution(
        intrinsics=Intrinsics(width_px, height_px, K, distortion),
        rms_px=rms_px,
        view_rms_px=view_rms,
        view_tilt_deg=tilts,
        deviations_px=deviations,
        coverage=coverage,
        outliers=outliers,
        warnings=_warnings(K, deviations, tilts, coverage, outliers),
    )


def covered_share(views: Sequence[FloatArray], width_px: int, height_px: int) -> float:
    """Return the share of the image that the boards' corners span, all photographs together."""
    import cv2  # noqa: PLC0415 - see above

    cells = np.zeros((_GRID, _GRID), np.uint8)
    size = np.array([width_px, height_px])
    for view in views:
        hull = cv2.convexHull(((view + 0.5) / size * _GRID - 0.5).astype(np.float32))
        cv2.fillConvexPoly(cells, np.rint(hull).astype(np.int32), 1)
    return float(cells.mean())


def _placed(grey: UInt8Array, rough: FloatArray, board: Board) -> FloatArray:
    import cv2  # noqa: PLC0415 - see above

    grid = rough.reshape(board.rows, board.columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
    reach = int(np.clip(min(steps) * 0.3, 3, 15))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    placed = cv2.cornerSubPix(
        grey, rough.astype(np.float32).reshape(-1, 1, 2), (reach, reach), (-1, -1), stop
    )
    return np.asarray(placed, np.float64).reshape(-1, 2)


def _edge_width_px(grey: UInt8Array, corners: FloatArray, pattern: tuple[int, int]) -> float:
    import cv2  # noqa: PLC0415 - see above

    measured, _ = cv2.estimateChessboardSharpness(
        grey, pattern, corners.astype(np.float32).reshape(-1, 1, 2)
    )
    width = float(np.asarray(measured).ravel()[0])
    return width if np.isfinite(width) else 0.0


def _calibrate(
    points: Sequence[Float32Array],
    seen: Sequence[Float32Array],
    size: tuple[int, int],
    flags: int,
) -> tuple[float, FloatArray, FloatArray, list[FloatArray], FloatArray, FloatArray]:
    import cv2  # noqa: PLC0415 - see above

    rms, K, distortion, turns, _, deviations, _, errors = cv2.calibrateCameraExtended(
        points,
        seen,
        size,
        np.eye(3),
        np.zeros(5),
        flags=flags,
    )
    return (
        float(rms),
        np.asarray(K, np.float64),
        np.asarray(distortion, np.float64).ravel()[:5],
        [np.asarray(turn, np.float64).ravel() for turn in turns],
        np.asarray(deviations, np.float64).ravel()[:4],
        np.asarray(errors, np.float64).ravel(),
    )


def _field_of_view_deg(K: FloatArray, width_px: int, height_px: int) -> float:
    diagonal = np.hypot(width_px / K[0, 0], height_px / K[1, 1])
    return degrees(2 * np.arctan(diagonal / 2))


def _refuse_absurd(
    K: FloatArray, distortion: FloatArray, rms_px: float, width_px: int, height_px: int
) -> None:
    finite = np.isfinite(K).all() and np.isfinite(distortion).all() and np.isfinite(rms_px)
    inside = 0 < K[0, 2] < width_px and 0 < K[1, 2] < height_px
    sound = 0.5 < K[0, 0] / K[1, 1] < 2 and 0.1 * width_px < K[0, 0] < 1000 * width_px
    if not (finite and inside and sound):
        raise ValueError(
            "the solution is no camera (its focal length or principal point is absurd): take "
            "photographs with the board tilted by 20 to 45 degrees to all sides"
        )


def _tilt_deg(turn: FloatArray) -> float:
    """Angle between the board's normal and the line of sight axis, 0 for straight on."""
    import cv2  # noqa: PLC0415 - see above

    R, _ = cv2.Rodrigues(turn)
    return degrees(np.arccos(min(1.0, abs(float(R[2, 2])))))


def _outliers(view_rms: FloatArray) -> tuple[int, ...]:
    limit = max(OUTLIER_RATIO * float(np.median(view_rms)), OUTLIER_FLOOR_PX)
    return tuple(int(index) for index in np.flatnonzero(view_rms > limit))


def _warnings(
    K: FloatArray,
    deviations: FloatArray,
    tilts: FloatArray,
    coverage: float,
    outliers: tuple[int, ...],
) -> tuple[str, ...]:
    found = []
    if len(tilts) < GOOD_VIEWS:
        found.append(f"only {len(tilts)} photographs; {GOOD_VIEWS} to 20 make it reliable")
    if tilts.max() < LEAST_TILT_DEG:
        found.append(
            "all boards are seen straight on, so the focal length is not determined: tilt the "
            "board by 20 to 45 degrees to all sides"
        )
    elif deviations[:2].max() > UNSURE_FOCAL * K[0, 0]:
        percent = 100 * deviations[:2].max() / K[0, 0]
        found.append(f"the focal length is uncertain by {percent:.1f} %: more tilted boards help")
    if coverage < GOOD_COVERAGE:
        found.append(
            f"boards reach {100 * coverage:.0f} % of the image: the distortion near the corners is "
            "a guess; bring the board there too"
        )
    if outliers:
        found.append(
            "some photographs fit far worse than the others: leave them out and solve again"
        )
    return tuple(found)
