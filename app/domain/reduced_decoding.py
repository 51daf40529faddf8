"""Photographs decoded smaller than they are, where a detector scales them down anyway.

A JPEG is decoded at a half, a quarter or an eighth of its sides in a fraction of the time, since
its blocks need not be worked out in full. The picture is then smoother than a large one scaled
down by looking at a few of its pixels, so boxes change a little: whether that matters is for a
site's ground truth to say. The reduced picture must still have at least the pixels that the
network is given. Sides that the divisor leaves a rest of are decoded in full: the last row would
stand for less than the others, and boxes would be off.

Source: the scaled inverse DCT of libjpeg.
"""

DIVISORS = (1, 2, 4, 8)


def divisor_for(image_px: tuple[int, int], needed_px: tuple[int, int], most: int) -> int:
    """Return the largest divisor of a photograph's sides that leaves enough of them.

    Args:
        image_px: width and height of the photograph.
        needed_px: width and height to which the detector scales it.
        most: the largest divisor that may be used.

    """
    return max(
        divisor
        for divisor in DIVISORS
        if divisor == 1
        or (
            divisor <= most
            and all(side % divisor == 0 for side in image_px)
            and all(
                side // divisor >= needed for side, needed in zip(image_px, needed_px, strict=True)
            )
        )
    )
