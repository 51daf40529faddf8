"""The way round a bend: straight on, along an arc, straight on again, as long as the speeds say.

Between two reports minutes apart a cubic spreads a turn over the whole time, while ships mostly
keep straight on and then turn. Course and speed at both ends tell more than a cubic uses: the two
straight legs meet in a corner, and how much shorter than round the corner the way was tells how
wide the turn was. In Danish and in Solent traffic this halves the largest errors over silences of
a minute and more; below that a cubic is as good.
"""

from math import atan2, cos, hypot, sin, tan

Vector = tuple[float, float]  # east and north

_LEAST_MPS = 1.0  # slower ships drift more than they steer
_LEAST_TURN, _LARGEST_TURN = 0.35, 2.9  # radians: a bend, and no U-turn, whose corner is far away
# A way so much shorter or longer than the speeds say was another one.
_SHORTEST, _LONGEST = 0.7, 1.4


def round_a_bend(
    chord_m: Vector, start_mps: Vector, end_mps: Vector, span_s: float, since_s: float
) -> Vector | None:
    """Return where a ship was so long after the first of two reports, m from it.

    Args:
        chord_m: from the first report's place to the last one's.
        start_mps: velocity at the first.
        end_mps: velocity at the last.
        span_s: between the two.
        since_s: since the first, at most `span_s`.

    Returns:
        None where no bend explains both: hardly a turn, legs that do not meet, another length.

    """
    start, end = hypot(*start_mps), hypot(*end_mps)
    if min(start, end) < _LEAST_MPS:
        return None
    first = (start_mps[0] / start, start_mps[1] / start)
    last = (end_mps[0] / end, end_mps[1] / end)
    to_port = _cross(first, last)
    turn = abs(atan2(to_port, first[0] * last[0] + first[1] * last[1]))
    if not _LEAST_TURN < turn < _LARGEST_TURN:
        return None
    before_m, after_m = _cross(chord_m, last) / to_port, _cross(first, chord_m) / to_port
    if min(before_m, after_m) <= 0:
        return None
    by_speed_m = (start + end) / 2 * span_s
    half = tan(turn / 2)
    radius_m = (before_m + after_m - by_speed_m) / (2 * half - turn)
    radius_m = min(max(radius_m, 0.0), min(before_m, after_m) / half)
    straight_m = before_m - radius_m * half
    whole_m = straight_m + radius_m * turn + after_m - radius_m * half
    if not _SHORTEST < whole_m / by_speed_m < _LONGEST:
        return None
    gone_m = (start + (end - start) * since_s / (2 * span_s)) * since_s * whole_m / by_speed_m
    if gone_m >= straight_m + radius_m * turn:
        left_m = whole_m - gone_m
        return (chord_m[0] - last[0] * left_m, chord_m[1] - last[1] * left_m)
    angle = max(0.0, gone_m - straight_m) / radius_m if radius_m else 0.0
    along_m = min(gone_m, straight_m) + radius_m * sin(angle)
    aside_m = radius_m * (1 - cos(angle)) * (1 if to_port > 0 else -1)
    return (
        first[0] * along_m - first[1] * aside_m,
        first[1] * along_m + first[0] * aside_m,
    )


def _cross(one: Vector, other: Vector) -> float:
    return one[0] * other[1] - one[1] * other[0]
