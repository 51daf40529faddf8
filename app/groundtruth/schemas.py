"""Shapes of ground truth in two dimensions. Pixels count from the image's edge, as in COCO."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.groundtruth.importing import Imported, Looked
from app.groundtruth.service import Totals
from app.ids import RowId
from app.tables.groundtruth import (
    GroundTruthBox,
    GroundTruthFile,
    GroundTruthImage,
    VesselClass,
)

Pixel = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
_PLACE = {"x1_px": 962.6, "y1_px": 678.1, "x2_px": 1069.8, "y2_px": 729.0}


class BoxIn(BaseModel):
    """A box to draw: in a photograph, or in a ground truth image, which may be absent."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"image_id": 1, "vessel_class": "ship", **_PLACE}]},
    )

    image_id: RowId | None = Field(None, description="The photograph")
    ground_truth_image_id: RowId | None = Field(None, description="Or the ground truth image")
    vessel_class: VesselClass
    x1_px: Pixel
    y1_px: Pixel
    x2_px: Pixel
    y2_px: Pixel
    is_crowd: bool = Field(default=False, description="Many vessels that nobody can tell apart")

    @model_validator(mode="after")
    def _of_one_image(self) -> "BoxIn":
        if (self.image_id is None) == (self.ground_truth_image_id is None):
            raise ValueError("give either `image_id` or `ground_truth_image_id`")
        return self


class BoxPatch(BaseModel):
    """What shall change of a box."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{**_PLACE}]})

    vessel_class: VesselClass | None = None
    x1_px: Pixel | None = None
    y1_px: Pixel | None = None
    x2_px: Pixel | None = None
    y2_px: Pixel | None = None
    is_crowd: bool | None = None

    def changes(self) -> dict[str, object]:
        """Return the fields that were sent; nothing of a box can be taken away."""
        given = self.model_dump(exclude_unset=True)
        return {name: value for name, value in given.items() if value is not None}


class BoxOut(BaseModel):
    """A box by a person; `coco_id` and `category_id` are those of the file it came with."""

    id: int
    ground_truth_image_id: int
    image_id: int | None = Field(description="The photograph; null while it is absent")
    site_id: int
    vessel_class: VesselClass
    x1_px: float
    y1_px: float
    x2_px: float
    y2_px: float
    area_px2: float
    is_crowd: bool
    coco_id: int | None
    category_id: int | None
    created_at: datetime
    version: int

    @classmethod
    def of(cls, box: GroundTruthBox) -> "BoxOut":
        """Take the columns."""
        return cls(
            id=box.id,
            ground_truth_image_id=box.ground_truth_image_id,
            image_id=box.image.image_id,
            site_id=box.image.site_id,
            vessel_class=box.vessel_class,
            x1_px=box.x1_px,
            y1_px=box.y1_px,
            x2_px=box.x2_px,
            y2_px=box.y2_px,
            area_px2=box.area_px2,
            is_crowd=box.is_crowd,
            coco_id=box.coco_id,
            category_id=None if box.entry is None else box.entry["category_id"],
            created_at=box.created_at,
            version=box.version,
        )


class ImageIn(BaseModel):
    """A photograph that people draw in; `is_complete`: every vessel in it has its box."""

    model_config = ConfigDict(extra="forbid")

    image_id: RowId
    is_complete: bool = False


class ImagePatch(BaseModel):
    """Whether every vessel of an image has its box."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"is_complete": True}]}
    )

    is_complete: bool | None = None


class GroundTruthImageOut(BaseModel):
    """A photograph that people drew in; it may be absent here, known by its file's name."""

    id: int
    site_id: int
    image_id: int | None = Field(description="The photograph; null while it is absent")
    file_id: int | None = Field(description="The COCO file it came with")
    file_name: str
    width_px: int
    height_px: int
    coco_id: int | None
    is_complete: bool
    completed_at: datetime | None
    boxes: int
    version: int

    @classmethod
    def of(cls, image: GroundTruthImage, boxes: int) -> "GroundTruthImageOut":
        """Take the columns."""
        return cls(
            id=image.id,
            site_id=image.site_id,
            image_id=image.image_id,
            file_id=image.file_id,
            file_name=image.file_name,
            width_px=image.width_px,
            height_px=image.height_px,
            coco_id=image.coco_id,
            is_complete=image.is_complete,
            completed_at=image.completed_at,
            boxes=boxes,
            version=image.version,
        )


class SceneImage(BaseModel):
    """A photograph to draw in."""

    id: int
    file_name: str
    captured_at: datetime
    width_px: int
    height_px: int
    file_url: str
    preview_url: str


class SceneOut(BaseModel):
    """A photograph with the boxes in it, and where to go from it (ids of photographs)."""

    image: SceneImage
    ground_truth: GroundTruthImageOut | None = Field(
        description="Null while nobody has drawn in it"
    )
    boxes: list[BoxOut]
    earlier_id: int | None
    later_id: int | None
    next_open_id: int | None = Field(description="The next one whose boxes are not complete")


class GroundTruthFileOut(BaseModel):
    """A COCO file that was imported, and what is left of it."""

    id: int
    site_id: int
    file_name: str
    sha256: str
    class_of_category: dict[str, str] = Field(description="By category id; `none`: left out")
    images: int
    photographs_here: int
    images_complete: int
    boxes: int
    created_at: datetime

    @classmethod
    def of(cls, file: GroundTruthFile, totals: Totals) -> "GroundTruthFileOut":
        """Take the columns and the counts."""
        return cls(
            id=file.id,
            site_id=file.site_id,
            file_name=file.file_name,
            sha256=file.sha256,
            class_of_category=file.class_of_category,
            images=totals.images,
            photographs_here=totals.here,
            images_complete=totals.complete,
            boxes=totals.boxes,
            created_at=file.created_at,
        )


class ImportedOut(BaseModel):
    """What an import brought; `left_out` counts boxes of categories that are no vessels."""

    file_id: int
    images: int
    boxes: int
    linked: int = Field(description="Photographs of the site that were linked by name and size")
    left_out: int

    @classmethod
    def of(cls, imported: Imported) -> "ImportedOut":
        """Take the counts."""
        return cls(
            file_id=imported.file.id,
            images=imported.images,
            boxes=imported.boxes,
            linked=imported.linked,
            left_out=imported.left_out,
        )


class CategoryOut(BaseModel):
    """A category of a file; `proposed` is the class its name is, null where a person must say."""

    category_id: int
    name: str
    boxes: int
    proposed: str | None


class LookedOut(BaseModel):
    """What is in a file, before it is imported."""

    images: int
    boxes: int
    images_without_boxes: int
    photographs_here: int
    categories: list[CategoryOut]
    is_known: bool

    @classmethod
    def of(cls, looked: Looked) -> "LookedOut":
        """Take the counts."""
        return cls(
            images=looked.images,
            boxes=looked.boxes,
            images_without_boxes=looked.images_without_boxes,
            photographs_here=looked.photographs_here,
            categories=[
                CategoryOut(
                    category_id=one.category_id,
                    name=one.name,
                    boxes=one.boxes,
                    proposed=one.proposed,
                )
                for one in looked.categories
            ],
            is_known=looked.is_known,
        )


class LinkIn(BaseModel):
    """The site whose absent photographs are to be linked with those that came."""

    model_config = ConfigDict(extra="forbid")

    site_id: RowId


class LinkedOut(BaseModel):
    """How many photographs were linked."""

    linked: int
