"""Tables, one module per idea; importing the package registers them all."""

from app.tables import (
    ais,
    detection,
    exports,
    groundtruth,
    identity,
    imagery,
    notes,
    operation,
    practice,
    queues,
    registration,
    reviews,
    runs,
    sites,
    water,
)

__all__ = [
    "ais",
    "detection",
    "exports",
    "groundtruth",
    "identity",
    "imagery",
    "notes",
    "operation",
    "practice",
    "queues",
    "registration",
    "reviews",
    "runs",
    "sites",
    "water",
]
