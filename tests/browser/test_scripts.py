"""Scripts as the documentation prints them, run against a real server and its worker."""

import hashlib
import json
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import attrs
import httpx
import pytest
import sqlalchemy as sa

from app.tables.ais import AisPosition, AisStatic
from app.tables.identity import User
from tests.browser.conftest import ADMIN, Installation
from tests.factories import identity
from tests.worker_process import ROOT

pytest.importorskip("quaymark.client.rest", reason="needs the client that `make build` makes")
from quaymark.client import ApiError, Quaymark, api, download, models, wait

PHOTOGRAPHS = 6


@dataclass(frozen=True)
class Desk:
    """Where somebody writes a script: files in a folder, a server, a fresh viewport."""

    server: Quaymark
    address: str
    token: str
    viewport: models.ViewportOut
    folder: Path


@pytest.fixture
def desk(installation: Installation, tmp_path: Path) -> Desk:
    """Give a camera that sees the harbour, and what it is to be fed with, in a folder."""
    with installation.database.writing() as session:
        admin = session.scalars(sa.select(User).where(User.email == ADMIN)).one()
        token = identity.make_token(session, admin)
    server = Quaymark(installation.url, token)
    known = installation.harbour
    site = api.sites.get_site(server, known.site_id).to_dict()
    camera = api.cameras.get_camera(server, known.camera_id).to_dict()
    site |= {"name": f"Scripts {tmp_path.name}", "is_simulated": False}
    made_site = api.sites.create_site(server, models.SiteIn.from_dict(_only(models.SiteIn, site)))
    camera |= {"site_id": made_site.id, "file_name_pattern": "west_%Y%m%d_%H%M%S"}
    made = api.cameras.create_camera(
        server, models.CameraIn.from_dict(_only(models.CameraIn, camera))
    )
    viewport = api.viewports.create_viewport(server, models.ViewportIn(made.id, "Fairway"))
    _put_files(server, installation, tmp_path)
    return Desk(server, installation.url, token, viewport, tmp_path)


def _only(kind: type[attrs.AttrsInstance], values: dict[str, Any]) -> dict[str, Any]:
    names = {field.name.rstrip("_") for field in attrs.fields(kind)}
    return {name: value for name, value in values.items() if name in names}


def _put_files(server: Quaymark, installation: Installation, folder: Path) -> None:
    keypoints = api.landmarks.keypoints_as_csv(server, installation.harbour.viewport_ids[0])
    (folder / "keypoints.csv").write_text(keypoints)
    (folder / "photos").mkdir()
    camera_id = installation.harbour.camera_id
    images = api.images.list_images(server, camera_id=camera_id, limit=PHOTOGRAPHS).items
    for image in images:
        photo = folder / "photos" / f"west_{image.captured_at:%Y%m%d_%H%M%S}.jpg"
        photo.write_bytes(api.images.get_image_file(server, image.id).payload.read())
    (folder / "heard.nmea").write_text(_heard(installation))


def _heard(installation: Installation) -> str:
    """Return what the harbour's vessels sent, as a plain table."""
    dimensions = ("to_bow", "to_stern", "to_port", "to_starboard")
    columns = ("mmsi", "fix_time", "lat_deg", "lon_deg", "sog_kn", "cog_deg", "heading_deg")
    with installation.database.reading() as session:
        sizes = {
            static.mmsi: [getattr(static, f"{name}_m") for name in dimensions]
            for static in session.scalars(sa.select(AisStatic)).all()
        }
        lines = [
            [getattr(one, name) for name in columns] + sizes.get(one.mmsi, [""] * 4)
            for one in session.scalars(sa.select(AisPosition).order_by(AisPosition.id))
        ]
    head = ["mmsi", "time", "lat", "lon", "sog", "cog", "heading", *dimensions]
    texts = [["" if cell is None else str(cell) for cell in line] for line in [head, *lines]]
    return "\n".join(map(",".join, texts))


def _blocks(file_name: str, language: str) -> str:
    """Return the code of a document of the repository."""
    text = (ROOT / file_name).read_text()
    return "".join(re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE))


def test_the_readmes_ten_lines_lead_to_a_data_set(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As printed: registered, ingested, run, waited for, exported; then resumed and refused."""
    monkeypatch.chdir(desk.folder)
    code = _blocks("README.md", "python")
    lines = [line for line in code.splitlines() if line and "import" not in line.split()[:3]]
    assert len(lines) == 10
    names: dict[str, object] = {"address": desk.address, "token": desk.token}
    exec(compile(code, "README.md", "exec"), names)  # noqa: S102  what a reader would do
    poses = json.loads(Path("poses.json").read_text())
    assert poses["images"]
    assert poses["annotations"]

    export = api.exports.list_exports(desk.server).items[-1]
    whole = Path("poses.json").read_bytes()
    Path("again.json.part").write_bytes(whole[:100])
    assert download(desk.server, export, "again.json").read_bytes() == whole
    assert hashlib.sha256(whole).hexdigest() == export.sha256
    assert wait(desk.server, export).poses == export.poses
    with pytest.raises(ApiError, match="404") as refused:
        api.viewports.get_viewport(desk.server, 10**9)
    assert refused.value.status == httpx.codes.NOT_FOUND
    with pytest.raises(ApiError, match="422: name") as wrong:
        api.viewports.create_viewport(desk.server, models.ViewportIn(desk.viewport.camera_id, ""))
    assert wrong.value.errors[0]["field"] == "name"


def test_the_recipes_for_curl_do_what_they_say(desk: Desk) -> None:
    """One after the other, as printed, in a shell that stops at the first failure."""
    environment = os.environ | {
        "SERVER": desk.address,
        "TOKEN": desk.token,
        "CAMERA": str(desk.viewport.camera_id),
        "VIEWPORT": str(desk.viewport.id),
    }
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", _blocks("docs/scripts.md", "sh")],
        cwd=desk.folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "poses.ndjson: OK" in done.stdout
    last = json.loads((desk.folder / "poses.ndjson").read_text().splitlines()[-1])
    assert last["complete"] is True
    assert last["poses"] > 0
