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


def family_named(text: str) -> str | None:
    """Return the family that people mean, or `auto`; None for a name that means none."""
    family = text.strip().lower().replace("_", "-")
    return family if family in FAMILIES or family == AUTO else None
