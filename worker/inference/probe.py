"""A trial of an uploaded model in a process that may die of it.

Loading a model runs a lot of native code on a stranger's bytes: it can crash, hang or take all
memory. So it is loaded and run once on a grey image by a child process with limits of its own;
the worker only reads one line from it, and a child without a line is an answer as well.

    python -m worker.inference.probe FILE FAMILY
"""

import json
import os
import resource
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

_DEFAULT_MEMORY_BYTES = 6 * 2**30
_MOST_CPU_S = 240
_LONGEST_ANSWER = 4096
_PACKAGE_ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True, slots=True)
class ProbeResult:
    """Whether a model is ready for use; else the reason, for the person who uploaded it."""

    ready: bool
    reason: str | None
    signature: dict[str, object] | None


def probe(
    path: Path,
    family: str,
    timeout_s: float = 120.0,
    memory_bytes: int = _DEFAULT_MEMORY_BYTES,
) -> ProbeResult:
    """Try a model in a child process; whatever happens to the child becomes the result."""
    command = [sys.executable, "-m", __name__, str(path), family, str(memory_bytes)]
    inherited = os.environ.get("PYTHONPATH")
    search_path = os.pathsep.join(filter(None, [str(_PACKAGE_ROOT), inherited]))
    try:
        child = subprocess.run(  # noqa: S603 - our own interpreter and module, no shell
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            stdin=subprocess.DEVNULL,
            timeout=timeout_s,
            check=False,
            env={**os.environ, "PYTHONPATH": search_path},
        )
    except subprocess.TimeoutExpired:
        return _refused(f"the model did not load and run within {timeout_s:g} s")
    if child.returncode < 0:
        return _refused(
            f"the runtime crashed while it loaded the model ({_signal_name(-child.returncode)})"
        )
    try:
        answer = json.loads(child.stdout[-_LONGEST_ANSWER:].splitlines()[-1])
        return ProbeResult(bool(answer["ready"]), answer["reason"], answer["signature"])
    except (IndexError, KeyError, TypeError, ValueError):
        return _refused(
            f"the trial process ended without a result (exit code {child.returncode}); "
            f"it may use {memory_bytes // 2**20} MiB of memory"
        )


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _refused(reason: str) -> ProbeResult:
    return ProbeResult(ready=False, reason=reason, signature=None)


def _try_model(path: Path, family: str) -> ProbeResult:
    """Load the model and run it once; runs in the child."""
    # Imported here: the parent asks without loading a runtime, and the limit comes first.
    import numpy as np  # noqa: PLC0415

    from app.domain.detection import DetectionSettings  # noqa: PLC0415
    from app.domain.letterbox import PADDING_GREY  # noqa: PLC0415
    from worker.inference.families import open_detector  # noqa: PLC0415
    from worker.inference.session import ModelRefusedError, SessionSettings  # noqa: PLC0415

    try:
        detector = open_detector(
            path, family, DetectionSettings(class_ids=(0,)), SessionSettings(threads=1)
        )
        detector.detect(np.full((480, 640, 3), PADDING_GREY, dtype=np.uint8))
    except ModelRefusedError as refused:
        return _refused(str(refused))
    except MemoryError:
        return _refused("the model needs more memory than the trial allows")
    return ProbeResult(ready=True, reason=None, signature=detector.signature)


def _main(path: str, family: str, memory_bytes: str) -> int:
    limit = int(memory_bytes)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # A loop without end must not outlive a worker that was killed and can no longer stop it.
    resource.setrlimit(resource.RLIMIT_CPU, (_MOST_CPU_S, _MOST_CPU_S))
    result = _try_model(Path(path), family)
    answer = {"ready": result.ready, "reason": result.reason, "signature": result.signature}
    sys.stdout.write(json.dumps(answer) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:3], *(sys.argv[3:4] or [str(_DEFAULT_MEMORY_BYTES)])))
