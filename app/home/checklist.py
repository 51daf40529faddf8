"""From an empty installation to a graded pose: eleven steps that tick themselves.

Nothing is remembered of who clicked what: a step is done when the data says so, whoever did it and
however (by page, REST or shell). Each has the one link that leads on from where things stand.
"""

from dataclasses import dataclass

from app.home.repository import Facts
from app.registration.readiness import FEWEST_KEYPOINTS
from app.tables.sites import Site


@dataclass(frozen=True, slots=True)
class Step:
    """A step: what to do, why or how in a sentence, where, and whether it is done."""

    title: str
    sentence: str
    href: str
    is_done: bool


@dataclass(frozen=True, slots=True)
class Checklist:
    """The steps in their order; the first open one is the one to take."""

    steps: tuple[Step, ...]

    @property
    def done(self) -> int:
        """How many steps are done."""
        return sum(step.is_done for step in self.steps)

    @property
    def current(self) -> Step | None:
        """The step to take now; None when all are done."""
        return next((step for step in self.steps if not step.is_done), None)


NOTHING = Facts(None, None, 0, 0, None, False, False, None, None, 0, False)


def checklist(site: Site | None, facts: Facts) -> Checklist:
    """Return the steps for a site as far as it is; all open without a site."""
    place = f"/sites/{site.id}" if site else "/sites/new"
    camera = f"/cameras/{facts.camera_id}" if facts.camera_id else place
    viewport = f"/viewports/{facts.viewport_id}" if facts.viewport_id else camera
    editor = f"{viewport}/register" if facts.viewport_id else viewport
    run = f"/runs/{facts.run_id}" if facts.run_id else "/runs"
    registered = facts.registered_viewport_id
    return Checklist(
        (
            Step(
                "Make a site",
                "A stretch of water: an origin near your camera and the height of the water.",
                place,
                site is not None,
            ),
            Step(
                "Add a camera",
                "Its image size and focal length, in px, from the data sheet or a calibration.",
                f"/sites/{site.id}/cameras/new" if site and not facts.camera_id else camera,
                facts.camera_id is not None,
            ),
            Step(
                "Add a viewport",
                "One pointing of the camera; when it is turned, it gets another.",
                viewport if facts.viewport_id else f"{camera}/viewports/new",
                facts.viewport_id is not None,
            ),
            Step(
                "Upload photographs",
                "Drop them on the camera's page; their time comes from EXIF or the file name.",
                camera,
                facts.images > 0,
            ),
            Step(
                f"Mark {FEWEST_KEYPOINTS} landmarks",
                "Click each in a photograph and say where it stands on the map.",
                editor,
                facts.keypoints >= FEWEST_KEYPOINTS or registered is not None,
            ),
            Step(
                "Register the viewport",
                "Solves where the camera looks; now every pixel knows its place on the water.",
                editor,
                registered is not None,
            ),
            Step(
                "Import AIS",
                "A recording from the hours of your photographs, or a live feed.",
                "/ais",
                facts.has_ais,
            ),
            Step(
                "Get a detector",
                "An official YOLOX or your own ONNX file; the worker tries it out.",
                "/models",
                facts.has_detector,
            ),
            Step(
                "Start a run",
                "Finds the vessels, matches them with AIS and fits a 3D box to each.",
                f"/runs/new?viewport_id={registered}" if registered else "/runs/new",
                facts.run_id is not None,
            ),
            Step(
                "Grade the first pose",
                "The last run made no pose; its page says why and what to do."
                if facts.run_id and not facts.run_with_poses_id
                else "One key for each: 1 Good, 2 OK, 3 Bad, 4 Wrong match.",
                f"/runs/{facts.run_with_poses_id}/review" if facts.run_with_poses_id else run,
                facts.graded > 0,
            ),
            Step(
                "Export what is good",
                "COCO, or one of the other formats, with all that it came from.",
                "/exports",
                facts.exported,
            ),
        )
    )
