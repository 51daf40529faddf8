"""`quaymark model` with a real worker."""

import re
from pathlib import Path

import pytest

from app.config import Settings
from app.detectors.releases import PINNED_SHA256
from tests.factories.onnx_models import yolox_like
from tests.integration.commands.conftest import Shell
from tests.worker_process import WorkerProcess


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)  # workers take their time
@pytest.mark.slow
def test_adding_waits_for_the_verdict_of_a_worker(
    quaymark: Shell, settings: Settings, tmp_path: Path, shared_dir: Path
) -> None:
    """--wait ends with `ready` for a model that runs, and with exit 1 and the reason else."""
    weights = shared_dir / "models" / "yolox_nano.onnx"
    unfit = tmp_path / "unfit.onnx"
    unfit.write_bytes(yolox_like(output_shape=(1, 84, 4)))
    with WorkerProcess(settings, tmp_path / "worker.log"):
        good = quaymark("model", "add", weights, "--family", "yolox", "--name", "nano", "--wait")
        bad = quaymark("model", "add", unfit, "--family", "yolox", "--name", "unfit", "--wait")

    assert (good.code, good.out) == (0, "nano is ready, family yolox\n"), good.error
    assert bad.code == 1
    assert "unfit was refused: " in bad.error
    assert "nano" in quaymark("model", "list").out


def test_what_is_no_model_is_refused_at_once(quaymark: Shell, tmp_path: Path) -> None:
    """A file that is not ONNX never reaches a worker."""
    file = tmp_path / "model.onnx"
    file.write_bytes(b"weights, honestly")
    outcome = quaymark("model", "add", file, "--family", "yolox", "--name", "mine")

    assert (outcome.code, outcome.error.count("\n")) == (1, 1)
    assert quaymark("model", "list").out.startswith("no detectors yet")


def test_the_pinned_release_is_the_official_one() -> None:
    """Nano's pinned SHA-256 is that of the release: a typing error would refuse the true file."""
    assert PINNED_SHA256["yolox-nano"] == (
        "c789161ed43c8269fcd4e67c67eeeb4e80c622da2eb296a20bc6007bd18a0b7d"
    )
    assert all(re.fullmatch("[0-9a-f]{64}", sha256) for sha256 in PINNED_SHA256.values())
