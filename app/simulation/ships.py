"""The ships of the harbour: tug, ferry, barge convoy, container ship, sailing boat and more.

A ship is a mesh in its own vessel frame: x forward, y port, z up, origin at the waterline under
the middle of its length and beam. Its length and beam are exactly the mesh's, and its **height is
the top of the highest structure, masts included, above the waterline**: that is what a silhouette
shows. A convoy is several hulls that travel as one; each hull stays a part of its own.

Two fleets differ in hull proportions, arrangement and livery: what a detector or an estimator was
built from must not be what it is judged by.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from app.simulation import ship_plans
from app.simulation.mesh import Mesh
from app.simulation.ship_plans import Fleet, Plan


class ShipType(StrEnum):
    """Kinds of vessels."""

    TUG = "tug"
    FERRY = "ferry"
    CONVOY = "barge convoy"
    CONTAINER_SHIP = "container ship"
    SAILING_BOAT = "sailing boat"
    LAUNCH = "launch"
    INLAND_SHIP = "inland cargo ship"


AIS_SHIP_TYPE = {
    ShipType.TUG: 52,
    ShipType.FERRY: 60,
    ShipType.CONVOY: 31,
    ShipType.CONTAINER_SHIP: 71,
    ShipType.SAILING_BOAT: 36,
    ShipType.LAUNCH: 69,
    ShipType.INLAND_SHIP: 79,
}  # ITU-R M.1371-5, table 53

_PLANS: dict[ShipType, Callable[[np.random.Generator, Fleet], Plan]] = {
    ShipType.TUG: ship_plans.tug,
    ShipType.FERRY: ship_plans.ferry,
    ShipType.CONVOY: ship_plans.convoy,
    ShipType.CONTAINER_SHIP: ship_plans.container_ship,
    ShipType.SAILING_BOAT: ship_plans.sailing_boat,
    ShipType.LAUNCH: ship_plans.launch,
    ShipType.INLAND_SHIP: ship_plans.inland_ship,
}


@dataclass(frozen=True, eq=False)
class ShipPart:
    """One hull of a ship: a name, its mesh in the ship's frame and the middle of its waterline."""

    name: str
    mesh: Mesh
    middle_in_ship_m: tuple[float, float]
    length_m: float
    width_m: float
    height_m: float


@dataclass(frozen=True, eq=False)
class Ship:
    """A ship of a type with its parts (one, except for a convoy) and its overall size in metres."""

    ship_type: ShipType
    parts: tuple[ShipPart, ...]
    length_m: float
    width_m: float
    height_m: float

    @property
    def mesh(self) -> Mesh:
        """All parts as one mesh."""
        return Mesh.joined([part.mesh for part in self.parts])


def build_ship(
    ship_type: ShipType, rng: np.random.Generator, fleet: Fleet = Fleet.TRAINING
) -> Ship:
    """Build one ship of a type, its proportions and colours drawn from `rng`."""
    parts = []
    for name, mesh in _PLANS[ship_type](rng, fleet):
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        middle = (low + high) / 2
        size = high - low
        parts.append(
            ShipPart(
                name,
                mesh,
                (float(middle[0]), float(middle[1])),
                float(size[0]),
                float(size[1]),
                float(high[2]),
            )
        )
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    size = vertices.max(axis=0) - vertices.min(axis=0)
    return Ship(
        ship_type,
        tuple(parts),
        float(size[0]),
        float(size[1]),
        float(vertices[:, 2].max()),
    )
