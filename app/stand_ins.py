"""MMSI that stand in for the vessels of published labels, which name none.

No country has the digits 200, so no real vessel is meant.
"""

FIRST_STAND_IN = 200_000_000
STAND_INS = 1_000_000
