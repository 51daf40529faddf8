"""The wheel is whole: installed elsewhere it migrates and serves, with nothing of the checkout."""

import os
import re
import socket
import subprocess
import sys
import sysconfig
import time
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
UV = ROOT / ".tools" / "bin" / "uv"
START_WITHIN_S = 60.0


def uv(*arguments: str | Path) -> None:
    """Run the installer of the checkout."""
    if not UV.exists():
        pytest.skip("needs .tools/bin/uv, which `make build` fetches")
    subprocess.run([UV, *arguments], cwd=ROOT, check=True, capture_output=True)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    uv("build", "--wheel", "--out-dir", folder)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the wheel into an environment of its own; returns its folder of programs.

    Dependencies are lent by the present environment, which is as locked as a fresh one would be;
    a `.pth` file inside a lent folder is not read, so the checkout itself is not lent.
    """
    environment = tmp_path_factory.mktemp("elsewhere") / "env"
    uv("venv", "--python", sys.executable, environment)
    python = environment / "bin" / "python"
    uv("pip", "install", "--python", python, "--no-deps", wheel)
    packages = next((environment / "lib").glob("python*")) / "site-packages"
    (packages / "lent.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return environment / "bin"


@pytest.fixture
def surroundings(tmp_path: Path) -> dict[str, str]:
    """Give the environment variables of an installation in the test's own folder."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("QUAYMARK_")}
    kept.pop("PYTHONPATH", None)
    return kept | {"QUAYMARK_DATA_DIR": str(tmp_path / "var")}


def fetch(url: str) -> tuple[str, str]:
    """Return a text and its media type."""
    with urllib.request.urlopen(url, timeout=10) as answer:  # noqa: S310  our own server
        return answer.read().decode(), answer.headers.get_content_type()


@pytest.fixture
def address(installed: Path, surroundings: dict[str, str], tmp_path: Path) -> Iterator[str]:
    """Migrate and serve from the wheel, in another folder than the checkout."""
    program = installed / "quaymark"
    subprocess.run([program, "db", "upgrade"], cwd=tmp_path, env=surroundings, check=True)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with subprocess.Popen(
        [program, "serve", "--port", str(port)], cwd=tmp_path, env=surroundings
    ) as server:
        address = f"http://127.0.0.1:{port}"
        give_up_at_s = time.monotonic() + START_WITHIN_S
        while True:
            try:
                fetch(f"{address}/healthz")
                break
            except urllib.error.URLError:
                assert server.poll() is None, "the server has ended"
                assert time.monotonic() < give_up_at_s, "the server does not answer"
                time.sleep(0.1)
        yield address
        server.terminate()


@pytest.mark.slow
def test_the_wheel_serves_pages_with_their_styles_and_scripts(address: str) -> None:
    """The sign-in page comes, and every file of the front end that it names comes too."""
    html, _ = fetch(f"{address}/sign-in")
    named = re.findall(r'(?:href|src)="(/static/[^"]+)"', html)

    assert len(named) >= 3
    types = {fetch(address + name)[1] for name in named}
    assert types == {"text/css", "text/javascript"}


@pytest.mark.slow
def test_nothing_comes_from_the_checkout(
    installed: Path, surroundings: dict[str, str], tmp_path: Path
) -> None:
    """The web, the worker and what is not Python are those of the wheel."""
    code = (
        "import app.main, worker.main; from app.locator import locate; "
        "print(app.main.__file__, worker.main.__file__, "
        "*map(locate, ['templates', 'migrations', 'static/dist']))"
    )
    done = subprocess.run(
        [installed / "python", "-c", code],
        cwd=tmp_path,
        env=surroundings,
        check=True,
        capture_output=True,
        text=True,
    )
    for path in done.stdout.split():
        assert Path(path).is_relative_to(installed.parent)


@pytest.mark.slow
def test_the_client_comes_with_the_wheel_and_needs_only_its_extra(
    installed: Path, wheel: Path, tmp_path: Path
) -> None:
    """A typed package that loads nothing of the server; the extra names what it imports."""
    code = (
        "import sys; from quaymark.client import Quaymark, api, models; "
        "print(api.exports.request_export.__annotations__['return'].__name__); "
        "print(*{name.partition('.')[0] for name in sys.modules})"
    )
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [installed / "python", "-c", code],
        cwd=tmp_path,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    answer, loaded = done.stdout.splitlines()
    assert answer == "ExportOut"
    assert {"attrs", "httpx"} <= set(loaded.split())
    assert not {"app", "worker", "fastapi", "pydantic", "sqlalchemy"} & set(loaded.split())
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = [name for name in archive.namelist() if name.endswith("/METADATA")]
        needs = archive.read(metadata).decode()
        assert "quaymark/py.typed" in archive.namelist()
    for package in ("attrs", "httpx"):
        assert re.search(rf"^Requires-Dist: {package}\b.*extra == 'client'", needs, re.MULTILINE)


@pytest.mark.slow
def test_the_wheel_carries_no_tests_and_no_sources_of_the_front_end(wheel: Path) -> None:
    """Only what an installation runs is handed on."""
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.split("/")[0] for name in archive.namelist()}
        names = archive.namelist()

    assert {top for top in tops if not top.endswith(".dist-info")} == {"app", "worker", "quaymark"}
    assert not [name for name in names if name.endswith(".ts") or "/src/" in name]
    assert any(name.endswith("licenses/LICENSE") for name in names)


@pytest.mark.slow
def test_the_wheel_carries_the_demo_harbours_detector_and_its_card(wheel: Path) -> None:
    """The demo detects without the internet wherever it is installed."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())

    assert {f"app/simulation/harbour_yolox_nano.{end}" for end in ("onnx", "md")} <= names
