"""REST beside the import of recordings: looking at one first, and at what was not taken of one."""

from typing import Annotated

from fastapi import APIRouter, UploadFile
from fastapi.responses import StreamingResponse

from app.ais import actions, rejected, service
from app.ais.form_fields import MappingText
from app.ais.preview import preview
from app.ais.preview_schemas import PreviewOut
from app.auth.access import Access, Scope, allowed
from app.dependencies import SessionDep, SettingsDep, StorageDep

router = APIRouter()
Operator = Annotated[Access, allowed(Scope.INGEST)]


@router.post("/previews")
def preview_file(
    settings: SettingsDep,
    access: Operator,  # noqa: ARG001  who may import may look
    file: UploadFile,
    mapping: MappingText = "",
) -> PreviewOut:
    """Decode the first lines of a recording and store nothing.

    Tells the format, the first reports, the accounting of the portion and examples of what would
    be rejected. For a table it proposes which column is which: send `mapping` back, changed where
    it is wrong, to look again, and along with `POST /ais/files` to import.
    """
    chosen = actions.mapping_of(mapping)
    return PreviewOut.of(preview(file.file, max_bytes=settings.max_ais_file_bytes, mapping=chosen))


@router.get(
    "/files/{file_id:int}/rejected",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/csv": {}}, "description": "entry,line,reason,meaning,text"}},
)
def download_rejected(
    file_id: int,
    session: SessionDep,
    storage: StorageDep,
    settings: SettingsDep,
    access: Operator,
) -> StreamingResponse:
    """Return the lines that were not taken, each with its number and why, as CSV.

    They are found by decoding the stored recording again, as many as its accounting counts.
    """
    file = service.get_file(session, access.site_ids(Scope.INGEST), file_id)
    lines = rejected.rejected_lines(storage, file, max_bytes=settings.max_ais_file_bytes)
    return StreamingResponse(
        rejected.as_csv(lines),
        media_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="rejected-{file.id}.csv"'},
    )
