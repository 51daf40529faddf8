"""Small networks of random weights with the inputs and outputs of real detectors.

Whatever is asked for is computed from the image: its mean and its largest value by channel, times
random weights. So what comes out tells how the image was put in.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from onnx import TensorProto, helper, numpy_helper


@dataclass(frozen=True)
class Output:
    """An output: its name, true shape, the range of its values by last dimension, and its type.

    `declared` is the shape that the signature tells, where names stand for free dimensions.
    """

    name: str
    shape: tuple[int, ...]
    low: float | Sequence[float] = 0.0
    high: float | Sequence[float] = 1.0
    declared: tuple[int | str, ...] | None = None
    dtype: int = TensorProto.FLOAT


@dataclass(frozen=True)
class Network:
    """A network to build: the image's input, inputs that change nothing, and the outputs.

    `spread` is the deviation of the weights: small for values from 0 to 255.
    """

    outputs: Sequence[Output]
    input_name: str = "images"
    input_shape: tuple[int | str, ...] = (1, 3, 64, 64)
    others: Sequence[tuple[str, int, tuple[int | str, ...]]] = ()
    metadata: dict[str, object] = field(default_factory=dict)
    seed: int = 1
    spread: float = 0.1


def build(network: Network) -> bytes:
    """Return a network as an ONNX file."""
    rng = np.random.default_rng(network.seed)
    image = helper.make_tensor_value_info(
        network.input_name, TensorProto.FLOAT, list(network.input_shape)
    )
    axes = [-2, -1]
    nodes = [
        helper.make_node("ReduceMean", [network.input_name], ["means"], axes=axes, keepdims=0),
        helper.make_node("ReduceMax", [network.input_name], ["peaks"], axes=axes, keepdims=0),
        helper.make_node("Concat", ["means", "peaks"], ["both"], axis=-1),
        helper.make_node("Reshape", ["both", "six"], ["features"]),
    ]
    weights = [numpy_helper.from_array(np.array([1, 6]), "six")]
    for number, output in enumerate(network.outputs):
        made, tensors = _output(rng, output, str(number), network.spread)
        nodes += made
        weights += tensors
    graph = helper.make_graph(
        nodes,
        "random detector",
        [image, *(helper.make_tensor_value_info(n, t, list(s)) for n, t, s in network.others)],
        [
            helper.make_tensor_value_info(o.name, o.dtype, list(o.declared or o.shape))
            for o in network.outputs
        ],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    helper.set_model_props(
        model,
        {k: v if isinstance(v, str) else json.dumps(v) for k, v in network.metadata.items()},
    )
    return bytes(model.SerializeToString())


def _output(
    rng: np.random.Generator, output: Output, key: str, spread: float
) -> tuple[list[object], list[TensorProto]]:
    """Return low + (high - low) * sigmoid(features @ weights + bias), reshaped and cast."""
    count = int(np.prod(output.shape))
    low, high = np.float32(output.low), np.float32(output.high)
    tensors = {
        "weights": rng.normal(0, spread, (6, count)).astype(np.float32),
        "bias": rng.normal(0, 2, (1, count)).astype(np.float32),
        "shape": np.array(output.shape),
        "low": np.asarray(low, np.float32),
        "range": np.asarray(high - low, np.float32),
    }
    steps = [
        ("MatMul", ["features", f"weights{key}"], "sum"),
        ("Add", [f"sum{key}", f"bias{key}"], "logit"),
        ("Sigmoid", [f"logit{key}"], "share"),
        ("Reshape", [f"share{key}", f"shape{key}"], "shaped"),
        ("Mul", [f"shaped{key}", f"range{key}"], "scaled"),
        ("Add", [f"scaled{key}", f"low{key}"], "value"),
    ]
    nodes: list[object] = [helper.make_node(op, names, [out + key]) for op, names, out in steps]
    nodes.append(helper.make_node("Cast", [f"value{key}"], [output.name], to=output.dtype))
    return nodes, [numpy_helper.from_array(value, name + key) for name, value in tensors.items()]
