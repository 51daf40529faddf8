"""One printable page on a site and a period: what the data is, how good, and how it was made.

Every figure says what it is a share of, and one that is missing says why: a report is read by
people who were not there. It tells of no vessel by name or number.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.auth.access import Access, Scope
from app.db import now
from app.dependencies import SessionDep
from app.evaluation import report_repository as repository
from app.evaluation import selection
from app.evaluation.agreement_figures import agreement_figures
from app.evaluation.breakdown import Viewer
from app.evaluation.detector_schemas import detectors_out
from app.evaluation.detectors import detector_table
from app.evaluation.iou import iou_figures
from app.evaluation.matching import matching_figures
from app.evaluation.matching_schemas import matching_out
from app.evaluation.poses import pose_table
from app.evaluation.projection import projection_figures
from app.evaluation.review_figures import review_figures
from app.evaluation.review_schemas import figures_out
from app.evaluation.router import AskedDep, Reader
from app.evaluation.selection import Asked
from app.evaluation.truth_schemas import iou_out, poses_out
from app.runs import references, setting_words
from app.runs import service as runs
from app.sites import service as sites
from app.tables.reviews import Grade
from app.templating import page

MOST_CAMERAS = 6
router = APIRouter()


class WhichRuns(StrEnum):
    """Whose poses a report is about."""

    REFERENCE = "reference"
    ALL = "all"


@router.get("/sites/{site_id:int}/report")
def show_report(
    request: Request,
    site_id: int,
    session: SessionDep,
    access: Reader,
    asked: AskedDep,
    which: Annotated[WhichRuns, Query(alias="runs")] = WhichRuns.REFERENCE,
) -> Response:
    """Show the report of a site: of its reference run, where one is named, else of all its runs."""
    site = sites.get_site(session, site_id)
    access.require(Scope.READ, site.id)
    reference = references.reference_of(session, site_id)
    only = reference if which is WhichRuns.REFERENCE else None
    run_id = only.id if only else None
    limits = Asked(run_id, site_id, None, None, None, asked.since, asked.until)
    chosen = selection.select(session, access, limits)
    made = repository.runs(session, chosen)
    return page(
        request,
        "evaluation/report.html",
        status_code=200,
        crumbs=[
            {"label": "Sites", "href": "/sites"},
            {"label": site.name, "href": f"/sites/{site.id}"},
            {"label": "Report"},
        ],
        site=site,
        asked=limits,
        reference=reference,
        only_reference=only is not None,
        written_at=now(),
        cameras=_bounded(repository.cameras(session, site_id, chosen)),
        images_done=repository.images_done(session, chosen),
        heard=repository.heard(session, chosen),
        posed_vessels=repository.posed_vessels(session, chosen),
        runs=[(run, runs.label(run), setting_words.shown(run.parameters)) for run in made],
        class_sets={"moving": "moving", "all": "all classes"},
        grade_names={"good": "Good", "ok": "OK", "bad": "Bad", "wrong": "Wrong match"},
        **_figures(session, access, chosen),
    )


def _bounded(cameras: Sequence[repository.CameraImages]) -> list[repository.CameraImages]:
    """Return as many cameras as one page has room for: those with most images, then all others."""
    if len(cameras) <= MOST_CAMERAS:
        return list(cameras)
    busiest = sorted(cameras, key=lambda camera: camera.images, reverse=True)
    shown, others = busiest[: MOST_CAMERAS - 1], busiest[MOST_CAMERAS - 1 :]
    firsts = [camera.first_at for camera in others if camera.first_at is not None]
    lasts = [camera.last_at for camera in others if camera.last_at is not None]
    return [
        *sorted(shown, key=lambda camera: camera.name),
        repository.CameraImages(
            f"{len(others)} other cameras",
            sum(camera.images for camera in others),
            min(firsts, default=None),
            max(lasts, default=None),
        ),
    ]


def _figures(session: Session, access: Access, chosen: selection.Selection) -> dict[str, object]:
    """Return the results of the evaluation's pages for a selection, reviewers without names."""
    nobody = Viewer(access.user_id, False)
    agreement = agreement_figures(session, chosen, nobody)
    return {
        "detectors": detectors_out(detector_table(session, chosen)),
        "projection": projection_figures(session, chosen),
        "matching": matching_out(matching_figures(session, chosen), None),
        "iou": iou_out(iou_figures(session, chosen, clip=True)),
        "truth": poses_out(pose_table(session, chosen)),
        "reviews": figures_out(review_figures(session, chosen, nobody), agreement, None),
        "grades": list(Grade),
    }
