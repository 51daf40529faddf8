"""A stranger's model in a process that may die of it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import onnx
import pytest
from onnx import helper

from app.domain.detection import DetectionSettings
from tests.factories.detectors import endless, with_external_data
from tests.factories.onnx_models import external, yolox_like
from worker.inference import probe as probing
from worker.inference.families import open_detector
from worker.inference.probe import probe
from worker.inference.session import ModelRefusedError, SessionSettings


def test_a_good_model_is_ready_with_its_signature(shared_dir: Path) -> None:
    """The published model passes, and what it takes and gives is reported."""
    result = probe(shared_dir / "models/yolox_nano.onnx", "yolox")
    assert result.ready, result.reason
    assert result.signature is not None
    assert result.signature["width_px"] == 416
    assert result.signature["class_count"] == 80


def test_a_model_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    """The reason of the child reaches the parent word for word."""
    path = tmp_path / "model.onnx"
    path.write_bytes(yolox_like(output_shape=(1, 100, 85)))
    result = probe(path, "yolox")
    assert not result.ready
    assert result.reason is not None
    assert "[1, 84, 5 + classes]" in result.reason


def test_external_data_is_never_opened(tmp_path: Path) -> None:
    """A model that points to another file is refused for that, though the file exists."""
    model = onnx.ModelProto.FromString(yolox_like())
    (tmp_path / "secret.bin").write_bytes(b"\x00" * 4 * 84 * 85)
    external(model.graph.initializer[0], "secret.bin")
    path = tmp_path / "model.onnx"
    path.write_bytes(model.SerializeToString())
    result = probe(path, "yolox")
    assert result.reason is not None
    assert "external data" in result.reason


def test_a_model_that_takes_all_memory_is_refused(tmp_path: Path) -> None:
    """A model that asks for 400 GB when it runs is refused, and this process lives on."""
    model = onnx.ModelProto.FromString(yolox_like())
    size = helper.make_tensor("size", onnx.TensorProto.INT64, [1], [100_000_000_000])
    model.graph.initializer.append(size)
    model.graph.node.insert(0, helper.make_node("ConstantOfShape", ["size"], ["huge"]))
    model.graph.node.insert(1, helper.make_node("ReduceSum", ["huge"], ["more"], keepdims=0))
    model.graph.node[3].input[0] = "more"
    path = tmp_path / "model.onnx"
    path.write_bytes(model.SerializeToString())
    result = probe(path, "yolox")
    assert not result.ready
    assert result.reason


@pytest.mark.parametrize("kind", ["symbolic link", "hard link", "pipe"])
def test_no_link_beside_a_model_is_followed(tmp_path: Path, kind: str) -> None:
    """Tensors said to lie in a file of any kind are refused; a pipe would hang whoever opens it."""
    secret, beside = tmp_path / "secret", tmp_path / "weights.bin"
    secret.write_bytes(b"\x00" * 4 * 84 * 85)
    if kind == "symbolic link":
        beside.symlink_to(secret)
    elif kind == "hard link":
        beside.hardlink_to(secret)
    else:
        os.mkfifo(beside)
    path = tmp_path / "model.onnx"
    path.write_bytes(with_external_data("weights.bin"))
    with pytest.raises(ModelRefusedError, match="external data"):
        open_detector(path, "auto", DetectionSettings(), SessionSettings())


def test_an_endless_model_is_cut_off(tmp_path: Path) -> None:
    """A loop without an end is ended with its process when its time is over."""
    path = tmp_path / "model.onnx"
    path.write_bytes(endless())
    result = probe(path, "yolox", timeout_s=5.0)
    assert not result.ready
    assert result.reason is not None
    assert "5 s" in result.reason


def test_a_hanging_model_is_refused_in_time(shared_dir: Path) -> None:
    """A child that does not answer is ended, and the reason names the time it had."""
    result = probe(shared_dir / "models/yolox_nano.onnx", "yolox", timeout_s=0.01)
    assert result.reason is not None
    assert "0.01 s" in result.reason


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "SIGSEGV"),
        ("import os; os.abort()", "SIGABRT"),
        ("raise SystemExit(3)", "exit code 3"),
        ("print('no answer')", "without a result"),
        ("print('{}')", "without a result"),
    ],
)
def test_a_dying_child_is_an_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, code: str, reason: str
) -> None:
    """A crash of the runtime, which no model at hand provokes, is told as the reason."""
    interpreter = tmp_path / "python"
    interpreter.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{code}"\n')
    interpreter.chmod(0o755)
    monkeypatch.setattr(probing.sys, "executable", str(interpreter))
    result = probe(tmp_path / "model.onnx", "yolox")
    assert not result.ready
    assert result.reason is not None
    assert reason in result.reason


def test_the_command_prints_one_line_of_json(shared_dir: Path) -> None:
    """The probe can be run by hand."""
    model = shared_dir / "models/yolox_nano.onnx"
    answer = subprocess.run(
        [sys.executable, "-m", "worker.inference.probe", model, "yolox"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert answer.count("\n") == 1
    assert json.loads(answer)["ready"] is True
