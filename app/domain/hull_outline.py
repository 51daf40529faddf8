"""How a ship's deck lies within the rectangle of its AIS dimensions.

AIS gives four distances, a rectangle; ships have no corners there. What touches the edges of a
detection is a bow that tapers to its stem and a stern that is a little narrower than the beam, so
that a rectangle's corners stand out by up to a tenth of its width. The outline here is a generic
hull, the same for all ships: proportions of naval architecture's usual block-shaped displacement
ships, taken from no ship that estimators are judged by.
"""

from functools import cache

import numpy as np

from app.domain.arrays import FloatArray

_ENTRANCE = 0.25  # share of the length over which the bow tapers
_RUN = 0.1  # the same at the stern
_STERN_WIDTH = 0.8  # the transom's share of the beam
_FULLNESS = 2.2  # exponent of the bow's taper; 2 is a parabola
_BOW_POINTS = 6
# A barge, of length and beam 1: bow-port, bow-starboard, stern-starboard, stern-port.
FULL_HULL = np.array([[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]])
FULL_HULL.flags.writeable = False


@cache
def unit_outline() -> FloatArray:
    """Outline (n, 2) of a hull of length 1 and beam 1 about its middle: x forward, y to port."""
    stern = [[-0.5, _STERN_WIDTH / 2], [-0.5 + _RUN, 0.5]]
    return _mirrored(stern, _bow(_ENTRANCE, _FULLNESS, _BOW_POINTS))


@cache
def slim_outline() -> FloatArray:
    """Outline (n, 2) of a slim hull, as `unit_outline`: a long bow and a rounded stern."""
    stern = [[-0.5, 0.35], [-0.43, 0.437], [-0.37, 0.474], [-0.3, 0.5]]
    return _mirrored(stern, _bow(0.35, 2.0, 8))


def _bow(entrance: float, fullness: float, count: int) -> FloatArray:
    along = np.linspace(0.0, 1.0, count)
    return np.column_stack([0.5 - entrance * (1 - along), (1 - along**fullness) / 2])


def _mirrored(stern: list[list[float]], bow: FloatArray) -> FloatArray:
    port = np.vstack([np.array(stern), bow])
    outline = np.vstack([port, port[-2::-1] * (1.0, -1.0)])
    outline.flags.writeable = False
    return outline
