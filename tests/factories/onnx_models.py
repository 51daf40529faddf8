"""Small ONNX models: detectors that fit, almost fit, and do harm."""

import json
from collections.abc import Sequence

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def yolox_like(
    input_shape: Sequence[int | str] = (1, 3, 64, 64),
    output_shape: Sequence[int] = (1, 84, 85),
    input_type: int = TensorProto.FLOAT,
    class_names: Sequence[str] | None = None,
) -> bytes:
    """Return a model that answers any image with the same output, all zero but one boat.

    A 64 x 64 input has 84 cells; the boat is in the first cell of the first grid.
    """
    output = np.zeros(output_shape, dtype=np.float32)
    if output.ndim == 3 and output.shape[-1] > 5:
        output[0, 0, :5] = (0.5, 0.5, 1.0, 1.0, 0.9)
        output[0, 0, min(13, output.shape[-1] - 1)] = 0.9
    image = helper.make_tensor_value_info("images", input_type, list(input_shape))
    boxes = helper.make_tensor_value_info("output", TensorProto.FLOAT, list(output_shape))
    graph = helper.make_graph(
        [
            helper.make_node("Cast", ["images"], ["pixels"], to=TensorProto.FLOAT),
            helper.make_node("ReduceSum", ["pixels"], ["sum"], keepdims=0),
            helper.make_node("Mul", ["sum", "zero"], ["nothing"]),
            helper.make_node("Add", ["answer", "nothing"], ["output"]),
        ],
        "constant detector",
        [image],
        [boxes],
        [
            numpy_helper.from_array(output, "answer"),
            numpy_helper.from_array(np.array(0.0, dtype=np.float32), "zero"),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    if class_names is not None:
        helper.set_model_props(model, {"class_names": json.dumps(list(class_names))})
    return bytes(model.SerializeToString())


def external(tensor: onnx.TensorProto, location: str) -> onnx.TensorProto:
    """Make a tensor's data lie in another file."""
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=location)
    return tensor
