"""A look into a model file before any runtime opens it.

An ONNX file may tell the runtime to load tensors from other files by path, which turns an upload
into a reader of the server's disk; and what is called `.onnx` may be a pickle, which runs code
when opened. So the file's protobuf structure is walked here without loading anything: big tensors
are skipped by their length, memory stays flat whatever the size, and neither a runtime nor the
`onnx` package is needed in the web process.

Source: protobuf wire format; `onnx.proto` (field numbers of IR version 11).
"""

import mmap
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

_DEEPEST = 100  # messages within messages, as protobuf itself allows
_MOST_FIELDS = 1_000_000  # fifty times those of a large detector: two seconds of walking
_FIRST_INVALID_NUMBER = 1 << 29
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
_FIXED_SIZES = {_FIXED64: 8, _FIXED32: 4}

# Which fields of which message lead to tensors, however deep they are hidden.
_CHILDREN: dict[str, dict[int, str]] = {
    "Model": {7: "Graph", 20: "Training", 25: "Function"},
    "Training": {1: "Graph", 2: "Graph"},
    "Function": {7: "Node", 11: "Attribute"},
    "Graph": {1: "Node", 5: "Tensor", 15: "SparseTensor"},
    "Node": {5: "Attribute"},
    "Attribute": {
        5: "Tensor",
        6: "Graph",
        10: "Tensor",
        11: "Graph",
        22: "SparseTensor",
        23: "SparseTensor",
    },
    "SparseTensor": {1: "Tensor", 2: "Tensor"},
    "Tensor": {},
}
_EXTERNAL_DATA, _DATA_LOCATION = 13, 14
_IR_VERSION = 1
_INDISPENSABLE = {_IR_VERSION: "IR version", 7: "graph", 8: "operator set"}

_OTHER_KINDS = (
    (b"PK\x03\x04", "a zip archive, as PyTorch saves its checkpoints"),
    (b"\x80", "a Python pickle"),
    (b"\x89HDF", "an HDF5 file"),
    (b"\x1f\x8b", "a gzip file"),
    (b"GGUF", "a GGUF file"),
    (b"<", "an HTML or XML page"),
)


class ModelFileError(ValueError):
    """The file cannot become a model; the message says why and what to do."""


class NotOnnxError(ModelFileError):
    """The file's content is not ONNX, whatever its name."""


class ExternalDataError(ModelFileError):
    """The file refers to other files for its tensors."""


@dataclass(frozen=True, slots=True)
class OnnxSummary:
    """What is known of an ONNX file from its structure alone."""

    ir_version: int
    node_count: int
    tensor_count: int


class _MalformedError(ValueError):
    """The bytes are no protobuf message of the expected kind."""


class _Field(NamedTuple):
    number: int
    wire_type: int
    value: int  # of a varint, else 0
    start: int  # of the content of a length-delimited field
    end: int


_Buffer = memoryview | mmap.mmap


def inspect_model_bytes(data: bytes) -> OnnxSummary:
    """Check that the bytes are a self-contained ONNX model.

    Raises:
        NotOnnxError: another kind of file, or a damaged one.
        ExternalDataError: a tensor's data is said to lie in another file.

    """
    return _inspect(memoryview(data))


def inspect_model_path(path: Path) -> OnnxSummary:
    """Check a file as `inspect_model_bytes` does, without reading it into memory."""
    with path.open("rb") as file:
        if path.stat().st_size == 0:
            return _inspect(memoryview(b""))  # an empty file cannot be mapped
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _inspect(data)


def _inspect(data: _Buffer) -> OnnxSummary:
    for magic, kind in _OTHER_KINDS:
        if data[: len(magic)] == magic:
            message = f"this is {kind}, not an ONNX model: export the detector to ONNX"
            raise NotOnnxError(message)
    walk = _Walk(data)
    try:
        walk.message("Model", 0, len(data), 0)
    except _MalformedError as malformed:
        message = f"not an ONNX model, or a damaged one ({malformed}): export the detector again"
        raise NotOnnxError(message) from malformed
    missing = [name for number, name in _INDISPENSABLE.items() if number not in walk.model_fields]
    if missing:
        message = f"not an ONNX model (without {', '.join(missing)}): export the detector to ONNX"
        raise NotOnnxError(message)
    return OnnxSummary(walk.model_fields[_IR_VERSION], walk.counts["Node"], walk.counts["Tensor"])


class _Walk:
    """Goes through a model's messages and stops at the first tensor that lies elsewhere."""

    def __init__(self, data: _Buffer) -> None:
        self._data = data
        self._fields_left = _MOST_FIELDS
        self.counts: Counter[str] = Counter()
        self.model_fields: dict[int, int] = {}

    def message(self, kind: str, start: int, end: int, depth: int) -> None:
        """Check one message of the kind and everything within it."""
        if depth > _DEEPEST:
            raise _MalformedError(f"messages nested more than {_DEEPEST} deep")
        self.counts[kind] += 1
        children = _CHILDREN[kind]
        for field in self._fields(start, end):
            if kind == "Model":
                self.model_fields[field.number] = field.value
            elif kind == "Tensor" and _is_elsewhere(field):
                raise ExternalDataError(
                    "a tensor of this model is stored in another file (external data): export "
                    "it again as one file, for example with onnx.save(save_as_external_data=False)"
                )
            child = children.get(field.number)
            if child is not None and field.wire_type == _LENGTH:
                self.message(child, field.start, field.end, depth + 1)

    def _fields(self, at: int, end: int) -> Iterator[_Field]:
        while at < end:
            self._fields_left -= 1
            if self._fields_left < 0:
                raise _MalformedError(f"more than {_MOST_FIELDS} fields")
            key, at = self._varint(at, end)
            number, wire_type = key >> 3, key & 7
            value, start = 0, at
            if wire_type == _VARINT:
                value, at = self._varint(at, end)
            elif wire_type == _LENGTH:
                length, start = self._varint(at, end)
                at = start + length
            elif wire_type in _FIXED_SIZES:
                at += _FIXED_SIZES[wire_type]
            else:
                raise _MalformedError(f"wire type {wire_type} at byte {start}")
            if not 0 < number < _FIRST_INVALID_NUMBER or at > end:
                raise _MalformedError(f"a field beyond its message at byte {start}")
            yield _Field(number, wire_type, value, start, at)

    def _varint(self, at: int, end: int) -> tuple[int, int]:
        value = 0
        for shift in range(0, 70, 7):
            if at >= end:
                break
            byte = self._data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value, at
        raise _MalformedError(f"a number cut off at byte {at}")


def _is_elsewhere(field: _Field) -> bool:
    """Whether a field of a tensor speaks of external data; location 0 is "here"."""
    return field.number == _EXTERNAL_DATA or (field.number == _DATA_LOCATION and field.value != 0)
