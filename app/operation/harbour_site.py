"""The demo harbour as a site: what a person would upload, put in through the same services.

Every part is looked for before it is made, so that an interrupted start is simply continued.
"""

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from sqlalchemy.orm import Session

from app.ais.service import import_ais_file
from app.config import Settings
from app.db import Database
from app.detectors.service import add_model_file
from app.domain.fusion_settings import PRESET_OF_RUNS
from app.errors import Conflict
from app.imagery.service import Upload, store_image
from app.jobs import JobClient
from app.operation import harbour_repository as repository
from app.operation.harbour_rows import camera_in, jpeg, keypoints_in, site_in, truth_rows
from app.registration import service as registration
from app.registration.schemas import KeypointsIn, RegistrationIn, ViewportIn
from app.runs.service import start_run
from app.simulation import DETECTOR_FILE
from app.simulation import harbour as simulation
from app.simulation.viewports import Viewport as SimulatedViewport
from app.sites import service as sites
from app.storage import Storage
from app.tables.sites import Camera, Site, Viewport

DETECTOR_NAME = "Demo harbour (rendered scenes only)"
RECORDING_NAME = "harbour.nmea"


@dataclass(frozen=True, slots=True)
class HarbourChoice:
    """Which harbour: another seed, count or size is another site beside the first."""

    seed: int = 19  # its first pose is a ferry, near, whole and in good light
    images: int = 32
    width_px: int = 1280
    height_px: int = 960

    @property
    def site_name(self) -> str:
        """Return the name of its site."""
        if self == HarbourChoice():
            return "Demo harbour"
        size = f"{self.width_px}x{self.height_px}"
        return f"Demo harbour, seed {self.seed}, {self.images} images of {size}"


class Tell(Protocol):
    """Shows a person what is going on; what is fleeting is only shown where it can be replaced."""

    def __call__(self, text: str, *, fleeting: bool = False) -> None:
        """Show a line."""


@dataclass(frozen=True, slots=True)
class HarbourSite:
    """The demo harbour's rows."""

    site_id: int
    camera_id: int
    viewport_ids: Sequence[int]


def find_complete(database: Database, choice: HarbourChoice) -> HarbourSite | None:
    """Return the demo harbour when all of it is there; its recording came in last."""
    with database.reading() as session:
        site = repository.simulated_site(session, choice.site_name)
        camera = repository.first_camera(session, site.id) if site else None
        if (
            site is None
            or camera is None
            or not repository.has_recording(session, site.id, RECORDING_NAME)
        ):
            return None
        viewports = repository.viewports(session, camera.id)
        return HarbourSite(site.id, camera.id, [viewport.id for viewport in viewports])


def install(
    database: Database, storage: Storage, settings: Settings, choice: HarbourChoice, tell: Tell
) -> HarbourSite:
    """Render the harbour and store it: site, camera, viewports, images, truth, AIS.

    Raises Conflict when an unfinished harbour of another version has the name.
    """
    tell("Building the demo harbour ...")
    harbour = simulation.make_harbour(choice.seed, choice.images, choice.width_px, choice.height_px)
    with database.writing() as session:
        site = _site(session, harbour, choice.site_name)
        camera = _camera(session, site, harbour)
    viewport_ids = [
        _viewport(database, camera.id, harbour, viewport) for viewport in harbour.camera.viewports
    ]
    with database.reading() as session:
        known = repository.names_of_images_with_truth(session, camera.id)
    for frame in harbour.frames:
        if frame.name in known:
            continue
        tell(f"Rendering image {frame.image_id} of {len(harbour.frames)} ...", fleeting=True)
        seen = frame.observe()
        upload = Upload(jpeg(seen.image), frame.name, frame.captured_at)
        image, _ = store_image(database, storage, settings, camera.id, upload)
        with database.writing() as session:
            repository.replace_truth(session, image.id, truth_rows(image.id, seen.truth))
    recording = io.BytesIO(harbour.nmea_text().encode())
    import_ais_file(database, storage, recording, site_id=site.id, file_name=RECORDING_NAME)
    return HarbourSite(site.id, camera.id, viewport_ids)


def add_detector(database: Database, storage: Storage, jobs: JobClient) -> str:
    """Add the detector trained on rendered harbours, once; a worker tries it. Returns its name."""
    content = hashlib.sha256(DETECTOR_FILE.read_bytes()).hexdigest()
    with database.reading() as session:
        known = repository.detector_of_content(session, content)
        taken = repository.has_detector(session, DETECTOR_NAME)
    if known is not None:
        return known
    # Another version's detector keeps its name: runs say by it what they used.
    name = f"{DETECTOR_NAME}, {content[:8]}" if taken else DETECTOR_NAME
    add_model_file(database, storage, jobs, DETECTOR_FILE, name=name, family="yolox")
    return name


def start_missing_runs(
    database: Database, jobs: JobClient, place: HarbourSite, detector: str
) -> list[int]:
    """Start a run on each viewport that has none with the detector; returns each one's newest."""
    run_ids = []
    for viewport_id in place.viewport_ids:
        with database.writing() as session:
            run_id = repository.newest_run(session, viewport_id, detector)
            if run_id is None:
                viewport = session.get_one(Viewport, viewport_id)
                run_id = start_run(
                    session,
                    jobs,
                    viewport_id=viewport_id,
                    detector=detector,
                    preset=PRESET_OF_RUNS.value,
                    parameters={},
                    name=f"Demo, {viewport.name}",
                ).id
            run_ids.append(run_id)
    return run_ids


def _site(session: Session, harbour: simulation.Harbour, name: str) -> Site:
    known = repository.simulated_site(session, name)
    if known is None:
        return sites.create_site(session, site_in(harbour, name))
    origin = harbour.site.origin
    if (known.origin_lat_deg, known.origin_lon_deg) != (origin.lat_deg, origin.lon_deg):
        raise Conflict(
            f"the site {name!r} is an unfinished harbour of another version of Quaymark; "
            "make another one: quaymark demo --seed 2"
        )
    return known


def _camera(session: Session, site: Site, harbour: simulation.Harbour) -> Camera:
    return repository.first_camera(session, site.id) or sites.create_camera(
        session, camera_in(harbour, site.id)
    )


def _viewport(
    database: Database,
    camera_id: int,
    harbour: simulation.Harbour,
    simulated: SimulatedViewport,
) -> int:
    with database.writing() as session:
        known = repository.viewports(session, camera_id)
        viewport = next((one for one in known if one.name == simulated.name), None)
        if viewport is None:
            viewport = registration.create_viewport(
                session,
                ViewportIn(
                    camera_id=camera_id,
                    name=simulated.name,
                    valid_from=simulated.valid_from,
                    valid_until=simulated.valid_until,
                ),
            )
        keypoints = KeypointsIn(keypoints=keypoints_in(harbour, simulated))
        registration.replace_keypoints(session, viewport, keypoints)
        registered = registration.newest_by_method(session, viewport.id)
    if not registered:
        for method in ("homography_water", "homography_pca", "pnp"):
            asked = RegistrationIn.model_validate({"method": method})
            registration.register(database, viewport.id, asked)
    return viewport.id
