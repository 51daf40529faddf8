"""Models that do harm, and rows of detectors."""

import hashlib
import json
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper
from sqlalchemy.orm import Session

from app.tables.detection import Model, ModelStatus
from tests.factories.onnx_models import external, yolox_like


def crashing() -> bytes:
    """Return a model that kills ONNX Runtime while it loads.

    The optimiser computes what is constant, and the processor traps on -2^31 divided by -1.
    """
    model = onnx.ModelProto.FromString(yolox_like())
    graph = model.graph
    graph.initializer.append(numpy_helper.from_array(np.array([-(2**31)], np.int32), "least"))
    graph.initializer.append(numpy_helper.from_array(np.array([-1], np.int32), "minus_one"))
    graph.node.insert(0, helper.make_node("Div", ["least", "minus_one"], ["trap"]))
    graph.node.insert(1, helper.make_node("Cast", ["trap"], ["as_float"], to=1))
    graph.node.insert(2, helper.make_node("ReduceSum", ["as_float"], ["as_scalar"], keepdims=0))
    graph.node[5].input[1] = "as_scalar"
    return bytes(model.SerializeToString())


def endless() -> bytes:
    """Return a YOLOX that counts to 2^63 before it answers."""
    model = onnx.ModelProto.FromString(yolox_like())
    boolean, whole, real = TensorProto.BOOL, TensorProto.INT64, TensorProto.FLOAT
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["go_on"], ["still"]),
            helper.make_node("Sin", ["value"], ["next"]),
        ],
        "body",
        [
            helper.make_tensor_value_info("turn", whole, []),
            helper.make_tensor_value_info("go_on", boolean, []),
            helper.make_tensor_value_info("value", real, []),
        ],
        [
            helper.make_tensor_value_info("still", boolean, []),
            helper.make_tensor_value_info("next", real, []),
        ],
    )
    graph = model.graph
    graph.initializer.append(numpy_helper.from_array(np.array(2**63 - 1), "turns"))
    graph.initializer.append(numpy_helper.from_array(np.array(True), "always"))
    loop = helper.make_node("Loop", ["turns", "always", "sum"], ["counted"], body=body)
    graph.node.insert(2, loop)
    graph.node[3].input[0] = "counted"
    return bytes(model.SerializeToString())


def with_external_data(location: str) -> bytes:
    """Return a model whose first tensor lies in another file."""
    model = onnx.ModelProto.FromString(yolox_like())
    external(model.graph.initializer[0], location)
    return bytes(model.SerializeToString())


def make_model(
    session: Session,
    name: str = "yolox-test",
    *,
    family: str = "yolox",
    status: ModelStatus = ModelStatus.READY,
) -> Model:
    """Insert a model's row; its bytes are stored nowhere."""
    model = Model(
        name=name,
        family=family,
        sha256=hashlib.sha256(name.encode()).hexdigest(),
        size_bytes=1000,
        status=status,
        signature={},
    )
    session.add(model)
    session.flush()
    return model


def results(*entries: tuple[object, list[float], float], category_id: int = 9) -> bytes:
    """Return COCO results of (image_id, bbox, score)."""
    return json.dumps([entry(*values, category_id=category_id) for values in entries]).encode()


def entry(
    image_id: object, bbox: object, score: object, *, category_id: object = 9
) -> dict[str, Any]:
    """Return one entry of COCO results."""
    return {"image_id": image_id, "category_id": category_id, "bbox": bbox, "score": score}
