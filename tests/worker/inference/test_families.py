"""Every family by its signature, against a decoding written out plainly from its source.

The networks are small and random; the references put the image in and read the outputs in their
own words, with loops, and share nothing with the product but the runtime.
"""

from collections.abc import Callable
from math import exp
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
import pytest
from onnx import TensorProto

from app.detectors.families import AUTO
from app.domain.detection import Detection, DetectionSettings
from tests.factories.random_networks import Network, Output, build
from worker.inference.detector import Detector
from worker.inference.families import open_detector
from worker.inference.session import ModelRefusedError, SessionSettings

IMAGE = np.random.default_rng(5).integers(0, 256, (90, 120, 3), dtype=np.uint8)
HEIGHT, WIDTH = IMAGE.shape[:2]
SETTINGS = DetectionSettings(score_threshold=0.4, nms_iou=0.45)
Found = list[tuple[float, float, float, float, float]]


def opened(tmp_path: Path, network: Network, family: str = AUTO) -> Detector:
    """Return a network as a detector."""
    path = tmp_path / "model.onnx"
    path.write_bytes(build(network))
    return open_detector(path, family, SETTINGS, SessionSettings(threads=1))


def bare(network: Network, tensor: np.ndarray, **others: np.ndarray) -> list[np.ndarray]:
    """Run a network with nothing around it."""
    session = onnxruntime.InferenceSession(build(network), providers=["CPUExecutionProvider"])
    feeds = {network.input_name: tensor.astype(np.float32), **others}
    return [np.asarray(value) for value in session.run(None, feeds)]


def channels_first(image: np.ndarray) -> np.ndarray:
    """Return (1, 3, height, width)."""
    return image.transpose(2, 0, 1)[None]


def imagenet(width: int, height: int) -> np.ndarray:
    """Scale to a size; red first, minus the mean of ImageNet, by its deviation."""
    rgb = cv2.resize(IMAGE, (width, height))[:, :, ::-1] / 255.0
    return channels_first((rgb - [0.485, 0.456, 0.406]) / [0.229, 0.224, 0.225])


def cut(box: list[float], score: float) -> tuple[float, float, float, float, float] | None:
    """Cut a box at the image; None if nothing is left."""
    x1, x2 = (min(max(x, 0.0), WIDTH) for x in box[0::2])
    y1, y2 = (min(max(y, 0.0), HEIGHT) for y in box[1::2])
    return (x1, y1, x2, y2, score) if x2 > x1 and y2 > y1 else None


def best_first(found: list[tuple[list[float], float]]) -> Found:
    """Return cut boxes by falling score."""
    boxes = [cut(box, score) for box, score in sorted(found, key=lambda f: -f[1])]
    return [box for box in boxes if box is not None]


def without_repeats(found: list[tuple[list[float], float]]) -> list[tuple[list[float], float]]:
    """Drop what overlaps a better one by more than the limit."""
    stay: list[tuple[list[float], float]] = []
    for box, score in sorted(found, key=lambda f: -f[1]):
        for other, _ in stay:
            w = max(0.0, min(box[2], other[2]) - max(box[0], other[0]))
            h = max(0.0, min(box[3], other[3]) - max(box[1], other[1]))
            areas = [(b[2] - b[0]) * (b[3] - b[1]) for b in (box, other)]
            if w * h / (sum(areas) - w * h) > SETTINGS.nms_iou:
                break
        else:
            stay.append((box, score))
    return stay


def same(ours: list[Detection], theirs: Found) -> bool:
    """Whether two lists are the same boats, to the rounding of single precision."""
    assert theirs, "a test that expects nothing proves nothing"
    assert len(ours) == len(theirs)
    mine = [(*d.edges_px, d.score) for d in ours]
    np.testing.assert_allclose(mine, theirs, atol=2e-3)
    return all(d.class_id == 8 for d in ours)


def centre_boxes(queries: int, name: str = "pred_boxes") -> Output:
    """Return the boxes of DETR: centre and size as shares."""
    return Output(name, (1, queries, 4), (0.2, 0.2, 0.05, 0.05), (0.8, 0.8, 0.6, 0.6))


def logits(queries: int, classes: int, boat: int, name: str = "logits") -> Output:
    """Return logits that see more boats than anything else."""
    high = [2.0] * classes
    high[boat] = 6.0
    return Output(name, (1, queries, classes), -4.0, high)


def corners(box: np.ndarray) -> list[float]:
    """Return a box of shares in image pixels."""
    x, y, w, h = box.tolist()
    return [(x - w / 2) * WIDTH, (y - h / 2) * HEIGHT, (x + w / 2) * WIDTH, (y + h / 2) * HEIGHT]


def softmax_boats(scores: np.ndarray, boxes: np.ndarray, boat: int) -> Found:
    """Read DETR as its paper does."""
    found = []
    for row, box in zip(scores[0].tolist(), boxes[0], strict=True):
        powers = [exp(value) for value in row]
        shares = [power / sum(powers) for power in powers][:-1]
        if shares.index(max(shares)) == boat and shares[boat] >= SETTINGS.score_threshold:
            found.append((corners(box), shares[boat]))
    return best_first(found)


def sigmoid_boats(scores: np.ndarray, boxes: np.ndarray, boat: int) -> Found:
    """Read Deformable DETR as its `PostProcess` does: the best hundred of all answers."""
    pairs = [
        (1 / (1 + exp(-value)), query, label)
        for query, row in enumerate(scores[0].tolist())
        for label, value in enumerate(row)
    ]
    best = sorted(pairs, key=lambda pair: -pair[0])[:100]
    kept = [p for p in best if p[2] == boat and p[0] >= SETTINGS.score_threshold]
    return best_first([(corners(boxes[0, query]), score) for score, query, _ in kept])


FREE = ("batch_size", "num_channels", "height", "width")


@pytest.mark.parametrize("has_mask", [False, True])
def test_detr_from_hugging_face(tmp_path: Path, has_mask: bool) -> None:  # noqa: FBT001  parametrised
    """92 logits: COCO's ids and "no object"; any size, short side 800; a mask if asked for."""
    mask = [("pixel_mask", TensorProto.INT64, ("batch_size", "height", "width"))]
    network = Network(
        [logits(100, 92, 9), centre_boxes(100)], "pixel_values", FREE, mask if has_mask else ()
    )
    detector = opened(tmp_path, network)
    others = {"pixel_mask": np.ones((1, 800, 1067), np.int64)} if has_mask else {}
    scores, boxes = bare(network, imagenet(1067, 800), **others)

    assert detector.signature["family"] == "detr"
    assert same(detector.detect(IMAGE), softmax_boats(scores, boxes, 9))


@pytest.mark.parametrize(
    ("classes", "boat", "stages", "family"),
    [
        (91, 9, 1, "deformable-detr"),
        (80, 8, 1, "deformable-detr"),
        (91, 9, 2, "deformable-detr-two-stage"),
    ],
)
def test_deformable_detr(tmp_path: Path, classes: int, boat: int, stages: int, family: str) -> None:
    """91 or 80 logits, each on its own; a second stage shows by what its encoder gives."""
    proposals = [
        Output("enc_outputs_class", (1, 20, classes)),
        Output("enc_outputs_coord_logits", (1, 20, 4)),
    ]
    network = Network(
        [
            logits(300, classes, boat, "pred_logits"),
            centre_boxes(300),
            *(proposals if stages == 2 else ()),
        ],
        input_shape=(1, 3, 64, 96),
    )
    detector = opened(tmp_path, network)
    scores, boxes = bare(network, imagenet(96, 64))[:2]

    assert detector.signature["family"] == family
    assert same(detector.detect(IMAGE), sigmoid_boats(scores, boxes, boat))


def labels(count: int, boat: int, shape: tuple[int, ...]) -> Output:
    """Return labels around the boat's."""
    assert shape[-1] == count
    return Output("labels", shape, boat - 0.9, boat + 1.9, dtype=TensorProto.INT64)


@pytest.mark.parametrize(
    ("family", "size", "padded"),
    [
        (AUTO, (1067, 800), (1088, 800)),
        ("detr", (1067, 800), (1067, 800)),
        ("yolov3", (608, 456), (608, 480)),
        ("yolox", (640, 480), (640, 480)),
    ],
)
def test_mmdetection_s_exports(
    tmp_path: Path, family: str, size: tuple[int, int], padded: tuple[int, int]
) -> None:
    """`dets` and `labels` from 0: Cascade R-CNN unless another family is named."""
    width, height = size
    low, high = (0, 0, width / 2, height / 2, 0), (width / 2, height / 2, width, height, 1)
    network = Network(
        [
            Output("dets", (1, 50, 5), low, high, ("batch", "n", 5)),
            labels(50, 8, (1, 50)),
            *([Output("masks", (1, 50, 28, 28))] if family == AUTO else ()),
        ],
        "input",
        ("batch", 3, "height", "width"),
        spread=0.001 if family == "yolox" else 0.1,
    )
    detector = opened(tmp_path, network, family)
    rgb = cv2.resize(IMAGE, size)[:, :, ::-1]
    plain = {"yolov3": rgb / 255.0, "yolox": rgb[:, :, ::-1]}
    tensor = np.full((1, 3, padded[1], padded[0]), 114.0 if family == "yolox" else 0.0)
    tensor[:, :, :height, :width] = (
        channels_first(plain[family]) if family in plain else imagenet(*size)
    )
    dets, kinds = bare(network, tensor)[:2]
    x_scale, y_scale = WIDTH / width, HEIGHT / height
    found = [
        ([x1 * x_scale, y1 * y_scale, x2 * x_scale, y2 * y_scale], score)
        for (x1, y1, x2, y2, score), kind in zip(dets[0].tolist(), kinds[0], strict=True)
        if kind == 8 and score >= SETTINGS.score_threshold
    ]

    assert detector.signature["family"] == (family if family != AUTO else "cascade-rcnn")
    assert same(detector.detect(IMAGE), best_first(found))


@pytest.mark.parametrize("shape", [(3, "height", "width"), (1, 3, "height", "width")])
def test_boxes_labels_and_scores_from_torchvision(
    tmp_path: Path, shape: tuple[int | str, ...]
) -> None:
    """The graph scales the image itself; labels are COCO's published ids."""
    low, high = (0, 0, 60, 50), (60, 40, 130, 95)
    network = Network(
        [
            Output("boxes", (50, 4), low, high, ("n", 4)),
            labels(50, 9, (50,)),
            Output("scores", (50,)),
        ],
        input_shape=shape,
    )
    detector = opened(tmp_path, network)
    shares = channels_first(IMAGE[:, :, ::-1] / 255.0)
    boxes, kinds, scores = bare(network, shares if len(shape) == 4 else shares[0])
    found = [
        (box, score)
        for box, kind, score in zip(boxes.tolist(), kinds, scores.tolist(), strict=True)
        if kind == 9 and score >= SETTINGS.score_threshold
    ]

    assert detector.signature["family"] == "cascade-rcnn"
    assert same(detector.detect(IMAGE), best_first(found))


def in_middle_of_grey(side: int) -> np.ndarray:
    """Scale 120 x 90 to the side's width, in the middle of grey 114; red first, 0 to 1."""
    grey = np.full((side, side, 3), 114.0)
    height = side * 90 // 120
    top = (side - height) // 2
    grey[top : top + height] = cv2.resize(IMAGE, (side, height))[:, :, ::-1]
    return channels_first(grey / 255.0)


def from_middle(box: list[float], side: int) -> list[float]:
    """Return a box of the input in image pixels."""
    top = (side - side * 90 // 120) // 2
    return [(v - top * (i % 2)) * 120 / side for i, v in enumerate(box)]


ANCHORS = {8: [10, 13, 16, 30, 33, 23], 16: [30, 61, 62, 45, 59, 119]} | {
    32: [116, 90, 156, 198, 373, 326]
}


def head(stride: int, arrange: Callable[[int, int], tuple[int, ...]]) -> Output:
    """Return a head of a 64 x 64 input: all logits alike."""
    return Output(f"head{stride}", arrange(64 // stride, 64 // stride), -1.0, 1.5)


@pytest.mark.parametrize(
    ("arrange", "plain"),
    [
        (
            lambda h, w: (1, 255, h, w),
            lambda a: a[0].reshape(3, 85, *a.shape[2:]).transpose(0, 2, 3, 1),
        ),
        (lambda h, w: (1, 3, h, w, 85), lambda a: a[0]),
        (
            lambda h, w: (1, h, w, 255),
            lambda a: a[0].reshape(*a.shape[1:3], 3, 85).transpose(2, 0, 1, 3),
        ),
    ],
    ids=["channels first", "by anchor", "channels last"],
)
def test_the_heads_of_yolov3(
    tmp_path: Path,
    arrange: Callable[[int, int], tuple[int, ...]],
    plain: Callable[[np.ndarray], np.ndarray],
) -> None:
    """Three grids in any of the usual orders are decoded by anchors and strides."""
    network = Network([head(stride, arrange) for stride in (32, 16, 8)])
    detector = opened(tmp_path, network)
    found = []
    for stride, output in zip((32, 16, 8), bare(network, in_middle_of_grey(64)), strict=True):
        cells = plain(output)
        for anchor, row, column in np.ndindex(*cells.shape[:3]):
            tx, ty, tw, th, to, *classes = cells[anchor, row, column].tolist()
            score = 1 / (1 + exp(-to)) / (1 + exp(-classes[8]))
            if score >= SETTINGS.score_threshold:
                x, y = (column + 1 / (1 + exp(-tx))) * stride, (row + 1 / (1 + exp(-ty))) * stride
                w, h = (a * exp(t) for a, t in zip(ANCHORS[stride][2 * anchor :], (tw, th)))  # noqa: B905  two of the rest
                box = from_middle([x - w / 2, y - h / 2, x + w / 2, y + h / 2], 64)
                found.append((box, score))

    assert detector.signature["family"] == "yolov3"
    assert same(detector.detect(IMAGE), best_first(without_repeats(found)))


def test_the_decoded_rows_of_yolov3(tmp_path: Path) -> None:
    """Rows of centre, size, chance and classes; the heads beside them are left alone."""
    low = [0.0, 0, 5, 5, 0.5] + [0.0] * 80
    high = [64.0, 64, 30, 30, 1.0] + [0.4] * 8 + [1.0] + [0.4] * 71
    rows = Output("output", (1, 252, 85), low, high)
    network = Network([rows, *(head(s, lambda h, w: (1, 3, h, w, 85)) for s in (8, 16, 32))])
    detector = opened(tmp_path, network)
    found = []
    for x, y, w, h, chance, *classes in bare(network, in_middle_of_grey(64))[0][0].tolist():
        if classes.index(max(classes)) == 8 and chance * classes[8] >= SETTINGS.score_threshold:
            box = from_middle([x - w / 2, y - h / 2, x + w / 2, y + h / 2], 64)
            found.append((box, chance * classes[8]))

    assert detector.signature["family"] == "yolov3"
    assert same(detector.detect(IMAGE), best_first(without_repeats(found)))


def test_yolov3_of_the_model_zoo(tmp_path: Path) -> None:
    """Chosen boxes y1 x1 y2 x2 in the photograph's own pixels, by indices of class and box."""
    low, high = (0, 0, 50, 60), (40, 60, 90, 120)
    network = Network(
        [
            Output("boxes", (1, 30, 4), low, high, ("b", "n", 4)),
            Output("scores", (1, 80, 30), declared=("b", 80, "n")),
            Output(
                "indices",
                (1, 20, 3),
                (-0.9, 7.1, 0),
                (0.9, 9.9, 29.9),
                ("b", "k", 3),
                TensorProto.INT32,
            ),
        ],
        "input_1",
        ("b", 3, "h", "w"),
        [("image_shape", TensorProto.FLOAT, ("b", 2))],
    )
    detector = opened(tmp_path, network)
    boxes, scores, indices = bare(
        network, in_middle_of_grey(416), image_shape=np.array([[90, 120]], np.float32)
    )
    found = []
    for _, label, index in indices[0].tolist():
        score = float(scores[0, label, index])
        if label == 8 and score >= SETTINGS.score_threshold:
            y1, x1, y2, x2 = boxes[0, index].tolist()
            found.append(([x1, y1, x2, y2], score))

    assert detector.signature["family"] == "yolov3"
    assert same(detector.detect(IMAGE), best_first(found))


def test_own_classes_need_their_names(tmp_path: Path) -> None:
    """DETR of five named classes has six logits; without the names it is refused by number."""
    outputs = [logits(100, 6, 2), centre_boxes(100)]
    names = {"class_names": ["tug", "ferry", "barge", "yacht", "buoy"]}
    path = tmp_path / "named.onnx"
    path.write_bytes(build(Network(outputs, metadata=names)))
    settings = DetectionSettings(class_ids=(2,))
    detector = open_detector(path, AUTO, settings, SessionSettings(threads=1))
    assert detector.signature["family"] == "detr"
    assert {found.class_id for found in detector.detect(IMAGE)} == {2}
    with pytest.raises(ModelRefusedError, match=r"5 classes.*class_names"):
        opened(tmp_path, Network(outputs))


@pytest.mark.parametrize(
    ("outputs", "family", "message"),
    [
        (
            [Output("embedding", (1, 512))],
            AUTO,
            r"'embedding' .*\[1, 512\].*fits no family.*yolov3:",
        ),
        ([Output("dets", (1, 9, 6)), labels(9, 8, (1, 9))], AUTO, "fits no family"),
        ([logits(100, 92, 9)], "detr", r"'logits'.*no detr.*pred_boxes"),
        ([Output("boxes", (9, 4))], "cascade-rcnn", r"no cascade-rcnn.*boxes \[n, 4\]"),
        ([Output("grid", (1, 255, 8, 8))], "yolov3", r"no yolov3.*three heads"),
    ],
)
def test_what_fits_nothing_is_told(
    tmp_path: Path, outputs: list[Output], family: str, message: str
) -> None:
    """The error names what was seen and what is expected."""
    with pytest.raises(ModelRefusedError, match=message):
        opened(tmp_path, Network(outputs), family)
