"""Write trained weights as ONNX, in the form of the YOLOX project's own exports.

Input `images` [1, 3, height, width], BGR, 0 to 255, letterboxed with grey 114; output `output`
[1, cells, 85], undecoded, so that the file is used like any other YOLOX-Nano with COCO's classes.
Batch normalisation is folded into the convolutions. What the file is stands in its metadata.
"""

import argparse
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from onnx import helper

from tools.train_harbour_detector.model import CocoShaped, YoloxNano

_ABOUT = {
    "name": "Quaymark demo harbour, YOLOX-Nano",
    "trained_on": "rendered scenes of app/simulation only; not for photographs",
    "licence": "Apache-2.0",
}


def export(weights: Path, out: Path, width_px: int, height_px: int) -> None:
    """Write the file; raises ValueError when it answers otherwise than the trained network."""
    network = YoloxNano()
    network.load_state_dict(torch.load(weights, weights_only=True))
    model = CocoShaped(network).eval()
    image = torch.rand(1, 3, height_px, width_px) * 255
    torch.onnx.export(
        model, (image,), str(out), input_names=["images"], output_names=["output"],
        opset_version=17, dynamo=False,
    )  # fmt: skip
    written = onnx.load(out)
    helper.set_model_props(written, _ABOUT)
    onnx.checker.check_model(written)
    onnx.save(written, out)
    session = onnxruntime.InferenceSession(str(out), providers=["CPUExecutionProvider"])
    answer = session.run(["output"], {"images": image.numpy()})[0]
    with torch.no_grad():
        expected = model(image).numpy()
    furthest = float(np.abs(answer - expected).max())
    if furthest > 1e-3:
        raise ValueError(f"the ONNX file answers {furthest} away from the trained network")


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--weights", type=Path, required=True, help="file written by train")
    parser.add_argument("--out", type=Path, required=True, help="the .onnx file")
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=480)
    wanted = parser.parse_args()
    export(wanted.weights, wanted.out, wanted.width, wanted.height)
    print(f"{wanted.out}: {wanted.out.stat().st_size} bytes")


if __name__ == "__main__":
    _main()
