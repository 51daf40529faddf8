"""Ship types in words: ITU-R M.1371-5, table 53, as far as people tell them apart by sight."""

_EXACT = {
    30: "fishing",
    31: "towing",
    32: "towing, long tow",
    33: "dredging",
    34: "diving",
    35: "military",
    36: "sailing",
    37: "pleasure craft",
    50: "pilot vessel",
    51: "search and rescue",
    52: "tug",
    53: "port tender",
    54: "anti-pollution",
    55: "law enforcement",
    58: "medical transport",
}
_TENS = {
    2: "wing in ground",
    4: "high-speed craft",
    6: "passenger",
    7: "cargo",
    8: "tanker",
    9: "other",
}


def ship_type_name(ship_type: int | None) -> str | None:
    """Return a ship type in words with its number; None when the vessel did not say."""
    if ship_type is None:
        return None
    name = _EXACT.get(ship_type) or _TENS.get(ship_type // 10)
    return f"{name} ({ship_type})" if name else f"type {ship_type}"
