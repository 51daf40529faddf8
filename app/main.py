"""The composition root: puts settings, database, store, jobs and all features into one app."""

import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from app import apidocs, health, problems
from app.admin import audit_pages
from app.admin import pages as admin_pages
from app.admin import people_router as people
from app.admin import router as admin
from app.ais import map_router as ais_map
from app.ais import pages as ais_pages
from app.ais import router as ais
from app.ais import upload_pages as ais_upload_pages
from app.auth import factor_pages
from app.auth import pages as auth_pages
from app.auth import router as auth
from app.auth.declared import refuse_undeclared_routes
from app.auth.protection import protect
from app.calibration import pages as calibration_pages
from app.calibration import router as calibration
from app.clocks import pages as clock_pages
from app.clocks import router as clocks
from app.config import Settings, get_settings
from app.db import MOST_SESSIONS, Database
from app.deletions import pages as deletion_pages
from app.deletions import router as deletions
from app.detectors import pages as detector_pages
from app.detectors import router as detectors
from app.evaluation import comparison_pages as run_comparison_pages
from app.evaluation import comparison_router as run_comparison
from app.evaluation import detector_pages as detector_table_pages
from app.evaluation import detector_router as detector_table
from app.evaluation import pages as evaluation_pages
from app.evaluation import plot_router as plots
from app.evaluation import projection_pages as projection_table_pages
from app.evaluation import projection_router as projection_table
from app.evaluation import report_pages
from app.evaluation import router as evaluation
from app.evaluation import truth_pages as truth_table_pages
from app.evaluation import truth_router as truth_table
from app.exports import pages as export_pages
from app.exports import router as exports
from app.feeds import pages as feed_pages
from app.feeds import router as feeds
from app.groundtruth import pages as ground_truth_pages
from app.groundtruth import router as ground_truth
from app.guideline import pages as guideline_pages
from app.guideline import router as guideline
from app.guideline import set_pages as calibration_set_pages
from app.home import pages as home_pages
from app.imagery import pages as imagery_pages
from app.imagery import router as imagery
from app.imports import pages as import_pages
from app.imports import router as imports
from app.jobs import JobClient
from app.keeping import pages as keeping_pages
from app.keeping import router as keeping
from app.learning import pages as learning_pages
from app.learning import router as learning
from app.live import pages as live_pages
from app.live import router as live
from app.oidc import pages as oidc_pages
from app.oidc.provider import Provider
from app.openapi import operation_id
from app.registration import editor_pages as registration_editor
from app.registration import landmark_router as landmarks
from app.registration import pages as registration_pages
from app.registration import router as registration
from app.reregistration import pages as reregistration_pages
from app.reregistration import router as reregistration
from app.retention import pages as retention_pages
from app.retention import router as retention
from app.reviews import pages as review_pages
from app.reviews import router as reviews
from app.runs import pages as run_pages
from app.runs import reference_router as reference_runs
from app.runs import router as runs
from app.session_slots import SessionSlots
from app.sites import pages as site_pages
from app.sites import router as sites
from app.sites import water_pages
from app.sites import water_router as water_levels
from app.statics import mount_statics
from app.storage import Storage
from app.webhooks import pages as webhook_pages
from app.webhooks import router as webhooks

API = "/api/v1"
REST = (
    reviews,  # first: routes are tried in this order, and these are asked for the most
    auth,
    admin,
    people,
    sites,
    water_levels,
    registration,
    landmarks,
    reregistration,
    calibration,
    imagery,
    imports,
    ais,
    ais_map,
    feeds,
    detectors,
    runs,
    reference_runs,
    evaluation,
    run_comparison,
    projection_table,
    detector_table,
    truth_table,
    plots,
    ground_truth,
    guideline,
    exports,
    clocks,
    learning,
    live,
    retention,
    deletions,
    keeping,
    webhooks,
)
PAGES = (
    home_pages,
    auth_pages,
    factor_pages,
    oidc_pages,
    admin_pages,
    audit_pages,
    site_pages,
    water_pages,
    registration_pages,
    reregistration_pages,
    calibration_pages,
    registration_editor,
    imagery_pages,
    import_pages,
    ais_pages,
    ais_upload_pages,
    feed_pages,
    detector_pages,
    run_pages,
    review_pages,
    evaluation_pages,
    run_comparison_pages,
    report_pages,
    projection_table_pages,
    detector_table_pages,
    truth_table_pages,
    ground_truth_pages,
    guideline_pages,
    calibration_set_pages,
    export_pages,
    clock_pages,
    learning_pages,
    live_pages,
    retention_pages,
    deletion_pages,
    keeping_pages,
    webhook_pages,
)


def create_app(settings: Settings | None = None) -> FastAPI:
    """Build the web application. Raises when a route forgot to declare its permission."""
    app = build_routes()
    furnish(app, settings or get_settings())
    return app


def build_routes() -> FastAPI:
    """Build the application's routes, which are the same for every installation.

    Raises when a route forgot to declare its permission.
    """
    app = FastAPI(
        title="Quaymark",
        version="1",
        summary="Shore-camera photographs and AIS messages, fused into reviewed 6D vessel poses",
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=_lifespan,
        generate_unique_id_function=operation_id,
    )
    app.include_router(health.router)
    app.include_router(apidocs.router)
    for feature in REST:
        app.include_router(feature.router, prefix=API)
    for feature in PAGES:
        app.include_router(feature.router, include_in_schema=False)
    mount_statics(app)
    problems.install(app)
    refuse_undeclared_routes(app)
    return app


def furnish(app: FastAPI, settings: Settings) -> None:
    """Give routes the database, store, jobs and protection of an installation, anew if need be."""
    app.state.settings = settings
    app.state.database = Database(settings.database_url)
    app.state.storage = Storage(settings.storage_url)
    app.state.jobs = JobClient(settings.database_url)
    app.state.leaving = threading.Event()  # set as the process stops: streams end
    app.state.session_slots = SessionSlots(MOST_SESSIONS)
    app.state.identity_provider = Provider(settings) if settings.has_provider else None
    app.state.prober = health.Prober(app.state.database, app.state.storage)
    app.user_middleware.clear()
    app.middleware_stack = None
    protect(app, settings)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    yield
    app.state.jobs.destroy()
    app.state.database.dispose()
