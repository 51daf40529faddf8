"""Everything that can be deleted for a while, found by its kind and id: what asks before needs it.

The features know their things; here each is looked up by its feature, with the name people know it
by and the page where its deleting begins and is done.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.ais import actions as ais
from app.auth.access import Access, Scope
from app.deletions.schemas import Entity
from app.detectors import service as detectors
from app.feeds import service as feeds
from app.groundtruth import service as groundtruth
from app.guideline import practice
from app.imagery import service as imagery
from app.live import folders, standing
from app.registration import landmarks
from app.registration import service as registration
from app.retention import service as retention
from app.reviews import notes, queues, run_images
from app.runs import service as runs
from app.sites import service as sites


@dataclass(frozen=True, slots=True)
class Thing:
    """What may be deleted. `place`: the page it is on; `action`: where a form deletes it.

    `stays` says what its deleting leaves alone. What is deleted by REST alone has no action.
    """

    name: str
    site_id: int | None
    place: str = ""
    action: str = ""
    stays: str = ""


WORDS: Mapping[str, str] = {
    "ais_file": "AIS recording",
    "calibration_set": "calibration set",
    "ground_truth_file": "ground truth file",
    "import": "image import",
    "missed_vessel": "missed vessel",
    "retention_rule": "retention rule",
    "review_queue": "review queue",
    "standing_run": "standing run",
    "watched_folder": "watched folder",
    "water_levels": "series of water levels",
}


def thing_for(
    session: Session, access: Access, scope: Scope, entity: Entity, identifier: int
) -> Thing:
    """Return a thing on whose site the caller holds a scope. Raises NotFound, Forbidden."""
    if entity == "ais_file":  # a recording of all sites is read on each of them
        file = ais.file_for(session, access, scope, identifier)
        return _on_page(ais.label(file), file.site_id, f"/ais/files/{file.id}")
    found = _FINDERS[entity](session, identifier)
    access.require(scope, found.site_id)
    return found


def _site(session: Session, site_id: int) -> Thing:
    site = sites.get_site(session, site_id)
    return _on_page(site.name, site.id, f"/sites/{site.id}")


def _camera(session: Session, camera_id: int) -> Thing:
    camera = sites.get_camera(session, camera_id)
    return _on_page(camera.name, camera.site_id, f"/cameras/{camera.id}")


def _viewport(session: Session, viewport_id: int) -> Thing:
    viewport = registration.get_viewport(session, viewport_id)
    return _on_page(viewport.name, viewport.camera.site_id, f"/viewports/{viewport.id}")


def _run(session: Session, run_id: int) -> Thing:
    run = runs.get_run(session, run_id)
    return _on_page(runs.label(run), run.site_id, f"/runs/{run.id}")


def _image(session: Session, image_id: int) -> Thing:
    image = imagery.get_image(session, image_id)
    return _on_page(image.file_name, image.site_id, f"/images/{image.id}")


def _calibration_set(session: Session, set_id: int) -> Thing:
    found = practice.get_set(session, set_id)
    return _on_page(found.name, found.run.site_id, f"/calibration-sets/{found.id}")


def _comment(session: Session, comment_id: int) -> Thing:
    comment = notes.get_comment(session, comment_id)
    return Thing(comment.text, run_images.site_of_image(session, comment.image_id))


def _feed(session: Session, feed_id: int) -> Thing:
    feed = feeds.get_feed(session, feed_id)
    place = f"/ais/feeds/{feed.id}"
    stays = "It is received no longer. The reports that came by it stay."
    return Thing(feed.name, feed.site_id, place, f"{place}/remove", stays)


def _ground_truth_file(session: Session, file_id: int) -> Thing:
    file = groundtruth.get_file(session, file_id)
    action = f"/ground-truth/files/{file.id}/delete"
    stays = "What people drew in its photographs goes along; the photographs themselves stay."
    return Thing(file.file_name, file.site_id, "/ground-truth", action, stays)


def _landmark(session: Session, landmark_id: int) -> Thing:
    landmark = landmarks.get(session, landmark_id)
    return Thing(landmark.name, landmark.site_id)


def _missed_vessel(session: Session, missed_id: int) -> Thing:
    missed = run_images.get_missed(session, missed_id)
    return Thing(missed.reason.value, run_images.site_of_image(session, missed.image_id))


def _model(session: Session, model_id: int) -> Thing:
    model = detectors.get_model(session, model_id)
    return _on_page(model.name, None, f"/models/{model.id}")


def _retention_rule(session: Session, rule_id: int) -> Thing:
    rule = retention.get(session, rule_id)
    return Thing(
        retention.label(rule),
        rule.site_id,
        f"/sites/{rule.site_id}/retention",
        f"/retention-rules/{rule.id}/delete",
        "Nothing goes by it any more. What went by it before is not brought back with it.",
    )


def _review_queue(session: Session, queue_id: int) -> Thing:
    queue = queues.get(session, queue_id)
    return Thing(queues.label(queue), queue.run.site_id, stays="What was graded stays.")


def _standing_run(session: Session, standing_id: int) -> Thing:
    row = standing.get(session, standing_id)
    return Thing(
        row.name,
        row.viewport.camera.site_id,
        f"/cameras/{row.viewport.camera_id}/live",
        f"/standing-runs/{row.id}/delete",
        "Its run stays with all poses; new images are no longer added to it.",
    )


def _watched_folder(session: Session, folder_id: int) -> Thing:
    row = folders.get(session, folder_id)
    return Thing(
        row.path,
        row.camera.site_id,
        f"/cameras/{row.camera_id}/live",
        f"/watched-folders/{row.id}/delete",
        "The images that came from it stay, and nothing in the folder is touched.",
    )


def _water_levels(session: Session, site_id: int) -> Thing:
    site = sites.get_site(session, site_id)
    place = f"/sites/{site.id}/water-levels"
    stays = "The site's constant level holds again."
    return Thing(f"of {site.name}", site.id, place, f"{place}/delete", stays)


def _on_page(name: str, site_id: int | None, place: str) -> Thing:
    return Thing(name, site_id, place, f"{place}/delete")


_FINDERS: Mapping[Entity, Callable[[Session, int], Thing]] = {
    "site": _site,
    "camera": _camera,
    "viewport": _viewport,
    "run": _run,
    "image": _image,
    "calibration_set": _calibration_set,
    "comment": _comment,
    "feed": _feed,
    "ground_truth_file": _ground_truth_file,
    "landmark": _landmark,
    "missed_vessel": _missed_vessel,
    "model": _model,
    "retention_rule": _retention_rule,
    "review_queue": _review_queue,
    "standing_run": _standing_run,
    "watched_folder": _watched_folder,
    "water_levels": _water_levels,
}
