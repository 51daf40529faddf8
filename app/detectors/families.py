"""The names of detector families: what an upload may say and a worker can run."""

AUTO = "auto"
"""The worker finds the family by the model's inputs and outputs when it tries it."""

FAMILIES = {
    "yolox": "YOLOX",
    "yolov3": "YOLOv3",
    "detr": "DETR",
    "deformable-detr": "Deformable DETR, one stage",
    "deformable-detr-two-stage": "Deformable DETR, two stages",
    "cascade-rcnn": "Cascade R-CNN",
}
