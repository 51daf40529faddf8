"""What the outputs of a network say, read as its family means them."""

from typing import NamedTuple

from app.domain.arrays import FloatArray
from app.domain.class_numbers import Labels


class Answers(NamedTuple):
    """Boxes (n, 4) x1 y1 x2 y2, scores (n,) and labels (n,).

    Whoever reads them says what boxes are measured in: shares of the image or input px.
    """

    boxes: FloatArray
    scores: FloatArray
    labels: Labels
