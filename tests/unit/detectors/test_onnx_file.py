"""A look into model files before any runtime opens them."""

import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import onnx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from onnx import helper, numpy_helper

from app.detectors.onnx_file import (
    ExternalDataError,
    ModelFileError,
    NotOnnxError,
    inspect_model_bytes,
    inspect_model_path,
)
from tests.factories.onnx_models import external, yolox_like


def outside(name: str = "w") -> onnx.TensorProto:
    """Return a tensor whose data lies in another file of the server."""
    return external(numpy_helper.from_array(np.zeros(4, np.float32), name), "../../etc/passwd")


def as_initializer(model: onnx.ModelProto) -> None:
    """Put it among the weights."""
    model.graph.initializer.append(outside())


def as_sparse_initializer(model: onnx.ModelProto) -> None:
    """Put it among the sparse weights."""
    model.graph.sparse_initializer.add().values.CopyFrom(outside())


def as_constant(model: onnx.ModelProto) -> None:
    """Put it into a constant node."""
    model.graph.node.append(helper.make_node("Constant", [], ["w"], value=outside()))


def as_list_attribute(model: onnx.ModelProto) -> None:
    """Put it into a node's list of tensors."""
    model.graph.node.append(helper.make_node("X", [], ["w"], values=[outside()]))


def within_a_branch(model: onnx.ModelProto) -> None:
    """Put it into the graph of a branch within a branch."""
    inner = helper.make_graph([], "inner", [], [], [outside()])
    node = helper.make_node("If", ["c"], ["w"], then_branch=inner, else_branch=inner)
    outer = helper.make_graph([node], "outer", [], [])
    model.graph.node.append(helper.make_node("If", ["c"], ["w"], then_branch=outer))


def within_a_function(model: onnx.ModelProto) -> None:
    """Put it into a function of the model's own."""
    model.functions.add().node.append(helper.make_node("Constant", [], ["w"], value=outside()))


def within_training(model: onnx.ModelProto) -> None:
    """Put it into the graph for training."""
    model.training_info.add().initialization.initializer.append(outside())


def location_without_mark(model: onnx.ModelProto) -> None:
    """Name a file without saying that the data is external."""
    tensor = outside()
    tensor.ClearField("data_location")
    model.graph.initializer.append(tensor)


@pytest.mark.parametrize(
    "hide",
    [
        as_initializer,
        as_sparse_initializer,
        as_constant,
        as_list_attribute,
        within_a_branch,
        within_a_function,
        within_training,
        location_without_mark,
    ],
)
def test_external_data_is_found_wherever_it_hides(
    hide: Callable[[onnx.ModelProto], None],
) -> None:
    """A reference to another file is refused in every place where ONNX allows a tensor."""
    model = onnx.ModelProto.FromString(yolox_like())
    hide(model)
    with pytest.raises(ExternalDataError, match="external data"):
        inspect_model_bytes(model.SerializeToString())


def test_a_real_model_passes(shared_dir: Path) -> None:
    """YOLOX-Nano as published is a self-contained model, and its parts are counted as onnx does."""
    path = shared_dir / "models/yolox_nano.onnx"
    model = onnx.load(path, load_external_data=False)
    summary = inspect_model_path(path)
    assert summary == inspect_model_bytes(path.read_bytes())
    assert summary.ir_version == model.ir_version
    assert summary.node_count == len(model.graph.node)
    constants = sum(a.HasField("t") for n in model.graph.node for a in n.attribute)
    assert summary.tensor_count == len(model.graph.initializer) + constants


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (pickle.dumps({"model": 1}), "pickle"),
        (pickle.dumps({"model": 1}, protocol=0), "not an ONNX"),
        (b"PK\x03\x04rest of a checkpoint", "zip"),
        (b"<html><body>404</body></html>", "HTML"),
        (b"GGUF\x03\x00", "GGUF"),
        (b"", "not an ONNX"),
        (b"\x00" * 100, "not an ONNX"),
        (b"plain text", "not an ONNX"),
    ],
)
def test_other_files_are_refused_by_their_content(tmp_path: Path, data: bytes, kind: str) -> None:
    """Whatever a file is called, its content decides, and the message says what it is."""
    path = tmp_path / "model.onnx"
    path.write_bytes(data)
    with pytest.raises(NotOnnxError, match=kind):
        inspect_model_path(path)
    with pytest.raises(NotOnnxError, match=kind):
        inspect_model_bytes(data)


def test_a_truncated_model_is_refused(shared_dir: Path) -> None:
    """A model cut off in the middle of a transfer is not taken."""
    data = (shared_dir / "models/yolox_nano.onnx").read_bytes()
    with pytest.raises(NotOnnxError, match="damaged"):
        inspect_model_bytes(data[: len(data) // 2])


def test_a_message_without_a_graph_is_refused() -> None:
    """A protobuf message that has the right shape and no graph is not a model."""
    with pytest.raises(NotOnnxError, match="graph"):
        inspect_model_bytes(onnx.ModelProto(ir_version=8).SerializeToString())


def test_endless_nesting_is_refused() -> None:
    """A graph within a graph, thousands deep, ends in an answer and not in a crash."""
    graph = b""
    for _ in range(5000):
        attribute = _field(6, graph)
        graph = _field(1, _field(5, attribute))
    with pytest.raises(NotOnnxError, match="deep"):
        inspect_model_bytes(b"\x08\x08" + _field(8, b"") + _field(7, graph))


def test_a_flood_of_fields_is_refused() -> None:
    """Millions of tiny fields, which would take minutes to walk, are cut short."""
    with pytest.raises(NotOnnxError, match="fields"):
        inspect_model_bytes(b"\x08\x08" * 1_000_001)


@given(st.binary(max_size=200), st.integers(0, 2000))
def test_damage_never_breaks_the_look(noise: bytes, at: int) -> None:
    """Any bytes, alone or within a sound model, are taken or refused with a reason."""
    sound = yolox_like()
    for data in (noise, sound[:at] + noise + sound[at + len(noise) :]):
        with suppress(ModelFileError):
            inspect_model_bytes(data)


def _field(number: int, content: bytes) -> bytes:
    """Encode a length-delimited protobuf field."""
    length, encoded = len(content), bytearray()
    while length >= 0x80:
        encoded.append(length & 0x7F | 0x80)
        length >>= 7
    encoded.append(length)
    return bytes([number << 3 | 2]) + bytes(encoded) + content
