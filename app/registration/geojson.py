"""Landmarks and keypoints as GeoJSON (RFC 7946): points with longitude, latitude, height.

Heights are above the WGS84 ellipsoid, as the standard has them. A keypoint carries its pixel and
role in the properties.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from app.errors import FieldError, Invalid

FIELD = "features"
MEDIA_TYPE = "application/geo+json"
_PLACE = frozenset({"lat_deg", "lon_deg", "height_m"})
Model = TypeVar("Model", bound=BaseModel)


def write_geojson(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> str:
    """Return rows with lat_deg, lon_deg and height_m as a collection; other columns describe."""
    features = [
        {
            "type": "Feature",
            "geometry": {
                "type": "Point",
                "coordinates": [row["lon_deg"], row["lat_deg"], row["height_m"]],
            },
            "properties": {name: row[name] for name in columns if name not in _PLACE},
        }
        for row in rows
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}, ensure_ascii=False)


def parse_geojson(text: str, model: type[Model], columns: Sequence[str]) -> list[Model]:
    """Read a collection of points. Raises Invalid naming the feature and what is wrong with it."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Invalid.field(FIELD, f"is no JSON: {error}") from error
    is_collection = isinstance(document, dict) and document.get("type") == "FeatureCollection"
    features = document.get("features") if is_collection else None
    if not isinstance(features, list):
        raise Invalid.field(FIELD, "give a GeoJSON FeatureCollection of points")
    return [_row(index, feature, model, columns) for index, feature in enumerate(features)]


def _row(index: int, feature: Any, model: type[Model], columns: Sequence[str]) -> Model:  # noqa: ANN401  whatever JSON holds
    parts = feature if isinstance(feature, dict) else {}
    geometry, properties = parts.get("geometry"), parts.get("properties")
    point = geometry.get("coordinates") if isinstance(geometry, dict) else None
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if kind != "Point" or not isinstance(point, list) or len(point) != 3:
        raise _wrong(index, "needs a Point of longitude, latitude and height (ellipsoidal, m)")
    given = properties if isinstance(properties, dict) else {}
    values = {name: given[name] for name in columns if name in given and name not in _PLACE}
    values |= dict(zip(("lon_deg", "lat_deg", "height_m"), point, strict=True))
    try:
        return model.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(step) for step in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        raise _wrong(index, f"{name}: {message}" if name else message) from error


def _wrong(index: int, reason: str) -> Invalid:
    return Invalid(
        f"feature {index + 1}: {reason}", fields=(FieldError(f"{FIELD}.{index}", reason),)
    )
