"""Recordings of any length, made in seconds: distinct AIS messages of a busy coast as NMEA text.

Made by arithmetic on whole columns, apart from the decoders that are measured with them. The mix
is that of a coast: mostly class A positions, some class B, statics in one sentence and in two, and
a few messages that nobody wants. Every payload is a message of its own.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Wrapping = Literal["tag block", "pghp", "suffix"]
Bytes = NDArray[np.uint8]
Fields = list[tuple[Any, int]]  # a column or one number for all, and its width in bits

VESSELS = 3_000
START_S = 1_714_521_600  # 2024-05-01
MESSAGES_A_SECOND = 60
_BLOCK = 50_000  # messages made at once
_ARMOUR = np.array([v + 48 if v < 40 else v + 56 for v in range(64)], dtype=np.uint8)
_HEX = np.frombuffer(b"0123456789ABCDEF", dtype=np.uint8)


def write_recording(
    path: Path, messages: int, wrapping: Wrapping = "tag block", seed: int = 0
) -> None:
    """Write so many messages; another seed gives other vessels, and so none of the same."""
    rng = np.random.default_rng(seed)
    with path.open("wb") as file:
        for first in range(0, messages, _BLOCK):
            count = min(_BLOCK, messages - first)
            file.write(b"".join(_block(rng, first, count, wrapping, seed)))


def _block(
    rng: np.random.Generator, first: int, count: int, wrapping: Wrapping, seed: int
) -> Iterator[bytes]:
    """Yield the lines of messages number `first` and on, in the order of time."""
    epoch_ms = (START_S * 1000) + (np.arange(first, first + count) * 1000) // MESSAGES_A_SECOND
    kinds = rng.choice(5, size=count, p=[0.80, 0.08, 0.06, 0.04, 0.02])
    lines: list[bytes] = [b""] * count
    makers = (_class_a, _class_b, _voyage, _name, _base_station)
    for kind, make in enumerate(makers):
        of_kind = np.flatnonzero(kinds == kind)
        if not of_kind.size:
            continue
        fields = make(rng, of_kind + first, epoch_ms[of_kind] // 1000 % 60, seed)
        text = _wrapped(_sentences(_armoured(fields)), epoch_ms[of_kind], wrapping)
        for at, line in zip(of_kind.tolist(), text, strict=True):
            lines[at] = line.tobytes()
    yield from lines


def _mmsi(number: NDArray[np.int64], seed: int) -> NDArray[np.int64]:
    return 211_000_000 + seed * VESSELS + number * 7919 % VESSELS


def _place(rng: np.random.Generator, mmsi: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    """Return longitude and latitude, 1/10,000 minute: each vessel keeps to some kilometres."""
    lon = (8.0 + mmsi * 6151 % 4_000 / 1_000) * 600_000 + rng.integers(0, 30_000, mmsi.size)
    lat = (53.0 + mmsi * 3571 % 2_500 / 1_000) * 600_000 + rng.integers(0, 30_000, mmsi.size)
    return lon.astype(np.int64), lat.astype(np.int64)


def _motion(rng: np.random.Generator, mmsi: NDArray[np.int64], second: NDArray[np.int64]) -> Fields:
    """Return the fields from speed to UTC second, which classes A and B share."""
    lon, lat = _place(rng, mmsi)
    speed, course = rng.integers(0, 250, mmsi.size), rng.integers(0, 3600, mmsi.size)
    heading = np.where(rng.random(mmsi.size) < 0.13, 511, course // 10)
    accurate = rng.integers(0, 2, mmsi.size)
    fields: Fields = [(speed, 10), (accurate, 1), (lon, 28), (lat, 27), (course, 12)]
    return [*fields, (heading, 9), (second, 6)]


def _class_a(
    rng: np.random.Generator, number: NDArray[np.int64], second: NDArray[np.int64], seed: int
) -> Fields:
    mmsi = _mmsi(number, seed)
    kind, turn = rng.choice([1, 1, 1, 3], mmsi.size), rng.integers(-20, 20, mmsi.size) & 255
    head: Fields = [(kind, 6), (0, 2), (mmsi, 30), (0, 4), (turn, 8)]
    return head + _motion(rng, mmsi, second) + [(0, 5), (rng.integers(0, 2**19, mmsi.size), 19)]


def _class_b(
    rng: np.random.Generator, number: NDArray[np.int64], second: NDArray[np.int64], seed: int
) -> Fields:
    mmsi = _mmsi(number, seed)
    head: Fields = [(18, 6), (0, 2), (mmsi, 30), (0, 8)]
    return head + _motion(rng, mmsi, second) + [(0, 9), (rng.integers(0, 2**20, mmsi.size), 20)]


def _voyage(
    rng: np.random.Generator, number: NDArray[np.int64], _second: NDArray[np.int64], seed: int
) -> Fields:
    mmsi = _mmsi(number, seed)
    eta = rng.integers(0, 2**20, mmsi.size)  # changes each time, as in life the draught does
    head: Fields = [(5, 6), (0, 2), (mmsi, 30), (0, 2), (mmsi % 9_000_000, 30)]
    sizes: Fields = [(100, 9), (20, 9), (10, 6), (8, 6)]
    text = _text(mmsi, 7) + _text(mmsi, 20) + [(70, 8)]
    rest: Fields = [(1, 4), (eta, 20), (100, 8), *_text(number, 20), (0, 2)]
    return head + text + sizes + rest


def _name(
    rng: np.random.Generator, number: NDArray[np.int64], _second: NDArray[np.int64], seed: int
) -> Fields:
    mmsi = _mmsi(number, seed)
    head: Fields = [(24, 6), (0, 2), (mmsi, 30), (0, 2)]
    return head + _text(rng.integers(0, 10**9, mmsi.size), 20) + [(0, 8)]


def _base_station(
    rng: np.random.Generator, number: NDArray[np.int64], _second: NDArray[np.int64], _seed: int
) -> Fields:
    return [(4, 6), (0, 2), (2_190_001, 30), (number, 38), (rng.integers(0, 2**30), 30), (0, 62)]


def _text(number: NDArray[np.int64], letters: int) -> Fields:
    """Return six-bit text: a word that tells the number, and padding."""
    digits: Fields = [(1 + number // 26**place % 26, 6) for place in range(min(letters, 7))]
    return digits + [(0, 6)] * (letters - len(digits))


def _armoured(fields: Fields) -> Bytes:
    """Return (messages, letters) of armoured payload; the fields fill six-bit letters, or nearly.

    Columns of bits are joined one by one, the highest first.
    """
    rows = max(np.size(value) for value, _ in fields)
    bits = np.concatenate(
        [
            np.broadcast_to(np.asarray(value).reshape(-1, 1), (rows, 1)) >> np.arange(width)[::-1]
            & 1
            for value, width in fields
        ],
        axis=1,
    )
    spare = -bits.shape[1] % 6
    bits = np.pad(bits, ((0, 0), (0, spare)))
    values = bits.reshape(rows, -1, 6) @ (32 >> np.arange(6))
    armoured: Bytes = _ARMOUR[values]
    return armoured


def _sentences(payload: Bytes) -> list[Bytes]:
    """Return the sentences of each message as (messages, letters): one column or two."""
    if payload.shape[1] <= 60:
        return [_checked(b"AIVDM,1,1,,A,", payload, b",0", b"!")]
    head, tail = payload[:, :59], payload[:, 59:]
    return [
        _checked(b"AIVDM,2,1,3,B,", head, b",0", b"!"),
        _checked(b"AIVDM,2,2,3,B,", tail, b",2", b"!"),
    ]


def _checked(before: bytes, body: Bytes, after: bytes, mark: bytes, end: bytes = b"") -> Bytes:
    """Return mark, text, `*` and checksum."""
    text = np.concatenate([_repeated(before, len(body)), body, _repeated(after, len(body))], axis=1)
    checksum = np.bitwise_xor.reduce(text, axis=1)
    hexadecimal = np.stack([_HEX[checksum >> 4], _HEX[checksum & 15]], axis=1)
    star, mark_column = _repeated(b"*", len(body)), _repeated(mark, len(body))
    return np.concatenate([mark_column, text, star, hexadecimal, _repeated(end, len(body))], axis=1)


def _wrapped(sentences: list[Bytes], epoch_ms: NDArray[np.int64], wrapping: Wrapping) -> Bytes:
    newline = _repeated(b"\r\n", len(epoch_ms))
    if wrapping == "tag block":
        time = _checked(b"s:station1,c:", _digits(epoch_ms, 13), b"", b"\\", b"\\")
        lines = [column for sentence in sentences for column in (time, sentence, newline)]
    elif wrapping == "pghp":
        moments = epoch_ms.astype("datetime64[ms]").astype(str)
        fields = [moment.translate(_TO_COMMAS).encode() for moment in moments]
        columns = np.frombuffer(b"".join(fields), dtype=np.uint8).reshape(len(fields), -1)
        time = _checked(b"PGHP,1,", columns, b",219,,2190067,1,00", b"$")
        lines = [time, newline]
        lines += [column for sentence in sentences for column in (sentence, newline)]
    else:
        time = np.concatenate(
            [_repeated(b",", len(epoch_ms)), _digits(epoch_ms // 1000, 10)], axis=1
        )
        lines = [column for sentence in sentences for column in (sentence, time, newline)]
    return np.concatenate(lines, axis=1)


_TO_COMMAS = str.maketrans("-T:.", ",,,,")


def _digits(value: NDArray[np.int64], width: int) -> Bytes:
    powers = 10 ** np.arange(width)[::-1]
    digits: Bytes = (48 + value[:, None] // powers % 10).astype(np.uint8)
    return digits


def _repeated(text: bytes, rows: int) -> Bytes:
    return np.tile(np.frombuffer(text, dtype=np.uint8), (rows, 1))
