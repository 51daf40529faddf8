"""What DETR and Deformable DETR say, made into boxes: a set of queries, no grid, no suppression.

Each query answers with one box and a logit for every class. DETR's classes exclude each other, and
one more of them means "no object"; Deformable DETR asks for each class on its own and takes the
best hundred answers of all queries and classes. Boxes are the centre and size as shares of the
image, answers their corners in the same shares.

Sources: Carion et al. 2020, Zhu et al. 2021, `PostProcess` of both projects.
"""

import numpy as np

from app.domain.answers import Answers
from app.domain.arrays import Float32Array, FloatArray

MOST_ANSWERS = 100


def exclusive_answers(logits: Float32Array, boxes: Float32Array) -> Answers:
    """Read DETR: logits (queries, classes + 1), the last "no object"; boxes (queries, 4)."""
    values = logits.astype(np.float64)
    powers = np.exp(values - values.max(axis=1, keepdims=True))
    shares = (powers / powers.sum(axis=1, keepdims=True))[:, :-1]
    labels = shares.argmax(axis=1)
    return Answers(_corners(boxes), shares[np.arange(len(labels)), labels], labels)


def independent_answers(logits: Float32Array, boxes: Float32Array) -> Answers:
    """Read Deformable DETR: logits (queries, classes), boxes (queries, 4); the best hundred."""
    flat = logits.astype(np.float64).ravel()
    best = np.argsort(-flat, kind="stable")[:MOST_ANSWERS]
    queries, labels = np.divmod(best, logits.shape[1])
    scores = 0.5 * (1.0 + np.tanh(flat[best] / 2))  # the sigmoid, without overflow
    return Answers(_corners(boxes)[queries], scores, labels)


def _corners(boxes: Float32Array) -> FloatArray:
    centre, half = boxes[:, :2].astype(np.float64), boxes[:, 2:].astype(np.float64) / 2
    return np.concatenate([centre - half, centre + half], axis=1)
