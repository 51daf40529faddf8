"""One ONNX Runtime session, with the few choices that matter for a machine shared with others.

Threads are limited, because a detector that takes every core starves the database and the other
workers beside it. They do not spin while they wait, for the same reason. A provider that is asked
for and not installed is an error: silently falling back to the processor costs a factor of twenty
that nobody would understand.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnxruntime

from app.detectors.onnx_file import ModelFileError, inspect_model_path
from app.domain.arrays import Float32Array


class ModelRefusedError(ValueError):
    """The model cannot be used; the message names what was found and what is expected."""


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """How a model is run: threads (0: as many as cores) and providers, best first."""

    threads: int = 0
    providers: tuple[str, ...] = ("CPUExecutionProvider",)


@dataclass(frozen=True, slots=True)
class TensorSignature:
    """Name, element type (`tensor(float)`) and shape of an input or output.

    A free dimension stands as its name, or None.
    """

    name: str
    element_type: str
    shape: tuple[int | str | None, ...]

    def __str__(self) -> str:
        return f"{self.name!r} {self.element_type} {list(self.shape)}"


def missing_providers(providers: Sequence[str]) -> str | None:
    """Return which of the wanted execution providers are not here, and what to do; None if none."""
    available = onnxruntime.get_available_providers()
    missing = [name for name in providers if name not in available]
    if not missing:
        return None
    return (
        f"execution provider {', '.join(missing)} is not installed here; there are "
        f"{', '.join(available)}: choose among them in QUAYMARK_DETECTOR_PROVIDERS, or install the "
        "build of onnxruntime that has it"
    )


class OnnxSession:
    """A loaded model: its signature, and one call from tensor to tensor.

    `unused_providers` are those that were asked for and could not take the model here, such as a
    GPU's on a machine without one; the runtime then uses the next.

    Raises ModelRefusedError when the runtime cannot load the file or a provider is missing.
    """

    def __init__(self, path: Path, settings: SessionSettings) -> None:
        if (missing := missing_providers(settings.providers)) is not None:
            raise ModelRefusedError(missing)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = settings.threads
        options.inter_op_num_threads = 1
        options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
        options.log_severity_level = 4  # what goes wrong is raised, and said once
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        try:
            inspect_model_path(path)
            self._session = onnxruntime.InferenceSession(
                str(path), options, providers=list(settings.providers)
            )
        except ModelFileError as error:
            raise ModelRefusedError(str(error)) from error
        except Exception as error:  # the runtime has a class of its own for each of its codes
            message = f"ONNX Runtime cannot load the model: {_without_place(error, path)}"
            raise ModelRefusedError(message) from error
        self.unused_providers = tuple(
            name for name in settings.providers if name not in self._session.get_providers()
        )
        self.inputs = _signatures(self._session.get_inputs())
        self.outputs = _signatures(self._session.get_outputs())
        self.metadata: dict[str, str] = dict(self._session.get_modelmeta().custom_metadata_map)

    def run(self, tensor: Float32Array) -> Float32Array:
        """Return the first output for the first input.

        Raises:
            ModelRefusedError: the runtime gave up on the model half-way.

        """
        name = self.outputs[0].name
        (output,) = self.answers([name], {self.inputs[0].name: tensor})
        return np.asarray(output, dtype=np.float32)

    def answers(
        self, outputs: Sequence[str], feeds: Mapping[str, npt.NDArray[np.generic]]
    ) -> list[npt.NDArray[np.generic]]:
        """Return the outputs of these names for all inputs by name.

        Raises:
            ModelRefusedError: the runtime gave up on the model half-way.

        """
        try:
            found = self._session.run(list(outputs), dict(feeds))
        except Exception as error:  # as above
            raise ModelRefusedError(f"the model does not run: {str(error)[:300]}") from error
        return [np.asarray(output) for output in found]


def _without_place(error: Exception, path: Path) -> str:
    """Return what the runtime says, without telling where this server keeps its files."""
    return str(error).replace(str(path), "the file")[:300]


def _signatures(tensors: list[onnxruntime.NodeArg]) -> tuple[TensorSignature, ...]:
    return tuple(
        TensorSignature(str(tensor.name), str(tensor.type), tuple(tensor.shape))
        for tensor in tensors
    )
