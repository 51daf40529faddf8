"""REST of detectors: models in, probed and listed; detections of other detectors in."""

from typing import Annotated

from fastapi import APIRouter, Form, Response, UploadFile

from app.auth.access import Access, Scope, allowed
from app.dependencies import (
    DatabaseDep,
    JobsDep,
    Page,
    PagingDep,
    SessionDep,
    SettingsDep,
    StorageDep,
)
from app.detectors import actions, service
from app.detectors.families import AUTO
from app.detectors.schemas import ImportedDetectionsOut, ModelOut
from app.tables.detection import ModelStatus

router = APIRouter(tags=["models"])
Reader = Annotated[Access, allowed(Scope.READ)]
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.post(
    "/models",
    status_code=202,
    responses={200: {"model": ModelOut, "description": "The same model was here already"}},
)
def add_model(
    session: SessionDep,
    storage: StorageDep,
    jobs: JobsDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    name: Annotated[str, Form(description="How runs call it", examples=["yolox-s-harbour"])],
    response: Response,
    family: Annotated[
        str,
        Form(
            description="yolox, yolov3, detr, deformable-detr, deformable-detr-two-stage or "
            "cascade-rcnn; auto: the worker tells by the model's inputs and outputs",
            examples=["auto"],
        ),
    ] = AUTO,
) -> ModelOut:
    """Add an ONNX model; a worker tries it, and `status` becomes `ready` or `refused`.

    Takes the scope `ingest` on all sites. The tensors must be in the file itself.
    """
    added = actions.add_upload(session, storage, jobs, settings, access, file, name, family)
    if not added.created:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/models/{added.model.id}"
    return ModelOut.model_validate(added.model)


@router.get("/models")
def list_models(
    session: SessionDep, access: Reader, paging: PagingDep, status: ModelStatus | None = None
) -> Page[ModelOut]:
    """List the models, oldest first."""
    del access  # models belong to no site: whoever may read anything may read them
    models, cursor = service.list_models(session, paging, status)
    return Page(items=[ModelOut.model_validate(model) for model in models], next_cursor=cursor)


@router.get("/models/{model_id:int}")
def get_model(model_id: int, session: SessionDep, access: Reader) -> ModelOut:
    """Show a model: whether it is ready, what it takes and gives, or why it was refused."""
    del access  # as above
    return ModelOut.model_validate(service.get_model(session, model_id))


@router.delete("/models/{model_id:int}", status_code=204)
def delete_model(model_id: int, session: SessionDep, access: Operator) -> None:
    """Delete a model that no run uses; for 30 days it can be restored with the boxes it found."""
    actions.delete_model(session, access, model_id)


@router.post(
    "/detections",
    status_code=201,
    responses={200: {"model": ImportedDetectionsOut, "description": "The same file was here"}},
)
def import_detections(
    database: DatabaseDep,
    session: SessionDep,
    settings: SettingsDep,
    access: Operator,
    file: UploadFile,
    response: Response,
    images: UploadFile | None = None,
    name: Annotated[str, Form(description="How runs call it; else the file's name")] = "",
    camera_id: Annotated[int | None, Form(description="Whose file names they are")] = None,
    categories: Annotated[
        str, Form(description="JSON: category ids that are vessels", examples=['{"9": 8}'])
    ] = "",
) -> ImportedDetectionsOut:
    """Import detections in COCO's results format; they become a model of family `imported`.

    `file` is a list of `{"image_id", "category_id", "bbox": [x, y, width, height], "score"}`, or an
    object with `annotations` and maybe `images` and `categories`. `image_id` is a file name or an
    id: of the `images` list (in the file, or in the field `images`), else our own, else that of the
    one ground truth file that has them all. Photographs that are absent here may be named if there
    is ground truth of them. Images without boxes get an empty set if the list of images names them.
    Vessels are, in this order: what `categories` says; categories named boat, ship or vessel;
    category 9 (COCO's boat); the file's only category, if it is 0, 1 or 8. Other boxes are ignored
    and counted. Boxes without width or height are false detections to an evaluation, as pycocotools
    has them; runs pass them over. An empty list says that nothing was found.
    """
    outcome = actions.import_detections(
        database,
        session,
        settings,
        access,
        file,
        images,
        name=name,
        camera_id=camera_id,
        categories=categories,
    )
    if not outcome.created:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/models/{outcome.model.id}"
    return ImportedDetectionsOut(
        model=ModelOut.model_validate(outcome.model),
        images=outcome.images,
        detections=outcome.detections,
        ignored=outcome.ignored,
        without_area=outcome.without_area,
        notes=outcome.notes,
    )
