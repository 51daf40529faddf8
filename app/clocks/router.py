"""REST of cameras' clocks."""

from typing import Annotated

from fastapi import APIRouter, Response

from app.auth.access import Access, Scope, allowed
from app.auth.idempotency import IdempotentRoute
from app.clocks import actions, service
from app.clocks.schemas import EstimateIn, EstimateOut, OffsetIn, OffsetOut
from app.dependencies import JobsDep, Page, SessionDep
from app.sites import actions as sites

router = APIRouter(tags=["clocks"], route_class=IdempotentRoute)
Reader = Annotated[Access, allowed(Scope.READ)]
Registrar = Annotated[Access, allowed(Scope.REGISTER)]


@router.get("/cameras/{camera_id:int}/clock-offsets")
def list_offsets(camera_id: int, session: SessionDep, access: Reader) -> Page[OffsetOut]:
    """List the history of a camera's clock, newest first."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    return Page(items=[OffsetOut.of(row) for row in service.history(session, camera.id)])


@router.post("/cameras/{camera_id:int}/clock-offsets", status_code=201)
def add_offset(camera_id: int, data: OffsetIn, session: SessionDep, access: Registrar) -> OffsetOut:
    """Correct a camera's clock over a range: its images get new times, runs of them go stale."""
    camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
    return OffsetOut.of(actions.add_offset(session, access, camera, data))


@router.post("/clock-offsets/{offset_id:int}/undo")
def undo_offset(offset_id: int, session: SessionDep, access: Registrar) -> OffsetOut:
    """Take a correction back: the one before it counts again."""
    return OffsetOut.of(actions.undo(session, access, offset_id))


@router.post("/cameras/{camera_id:int}/clock-estimates", status_code=202)
def start_estimate(
    camera_id: int,
    data: EstimateIn,
    session: SessionDep,
    jobs: JobsDep,
    access: Registrar,
    response: Response,
) -> EstimateOut:
    """Tell from the vessels on a run's images how far the clock is off; a worker does it."""
    camera = sites.camera_for(session, access, Scope.REGISTER, camera_id)
    row = actions.start_estimate(session, jobs, access, camera, data)
    response.headers["Location"] = f"/api/v1/cameras/{camera.id}/clock-estimates"
    return EstimateOut.of(row)


@router.get("/cameras/{camera_id:int}/clock-estimates")
def list_estimates(camera_id: int, session: SessionDep, access: Reader) -> Page[EstimateOut]:
    """List what images said of a camera's clock, newest first."""
    camera = sites.camera_for(session, access, Scope.READ, camera_id)
    return Page(items=[EstimateOut.of(row) for row in service.estimates(session, camera.id)])
