"""Detectors: what the worker, the command line and other features may ask for.

A model comes in as an ONNX file. Its structure is looked at before it is stored; whether it runs is
found out by the worker, in a process that may crash. Until then its status is `probing`.
"""

import hashlib
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sqlalchemy.orm import Session

from app.db import Database
from app.detectors import repository
from app.detectors.families import AUTO, FAMILIES, family_named
from app.detectors.onnx_file import ExternalDataError, NotOnnxError, inspect_model_path
from app.errors import Conflict, Invalid, NotFound, TooLarge, UnsupportedMedia
from app.jobs import JobClient, JobQueue
from app.paging import Paging
from app.storage import Storage
from app.tables.detection import Model, ModelStatus

PROBE_JOB = "probe_model"
IMPORTED_FAMILY = "imported"
# Imported boxes have no settings of ours: one constant stands for "as they came".
IMPORTED_SETTINGS_SHA256 = hashlib.sha256(b"imported").hexdigest()
LONGEST_NAME = 200
NO_MODEL = "there is no such model"
_CHUNK_BYTES = 1 << 20
_DEFAULT_MAX_BYTES = 1 << 30


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model file that was looked at and stored, and is not yet a row."""

    sha256: str
    size_bytes: int


@dataclass(frozen=True, slots=True)
class AddedModel:
    """A model, and whether this call made it."""

    model: Model
    created: bool


def checked_name(name: str) -> str:
    """Return a model's name without blanks around it. Raises Invalid."""
    name = name.strip()
    if not 1 <= len(name) <= LONGEST_NAME or not name.isprintable():
        raise Invalid.field("name", f"give 1 to {LONGEST_NAME} printable characters")
    return name


def checked_family(family: str) -> str:
    """Return a family that the worker can run, or `auto`, as we write it. Raises Invalid."""
    known = family_named(family)
    if known is None:
        raise Invalid.field("family", f"choose one of: {', '.join((AUTO, *FAMILIES))}")
    return known


def store_file(storage: Storage, stream: IO[bytes], *, max_bytes: int) -> ModelFile:
    """Look at a model file and store it. Raises TooLarge, UnsupportedMedia or Invalid."""
    with tempfile.NamedTemporaryFile(suffix=".onnx") as copy:
        size_bytes = 0
        while chunk := stream.read(_CHUNK_BYTES):
            size_bytes += len(chunk)
            if size_bytes > max_bytes:
                raise TooLarge(f"a model may have {max_bytes} bytes (QUAYMARK_MAX_MODEL_BYTES)")
            copy.write(chunk)
        copy.flush()
        try:
            inspect_model_path(Path(copy.name))
        except NotOnnxError as error:
            raise UnsupportedMedia(str(error)) from error
        except ExternalDataError as error:
            raise Invalid.field("file", str(error)) from error
        copy.seek(0)
        stored = storage.put_stream(copy)
    return ModelFile(stored.sha256, stored.size_bytes)


def add_model(
    session: Session,
    jobs: JobClient,
    file: ModelFile,
    *,
    name: str,
    family: str,
    user_id: int | None = None,
) -> AddedModel:
    """Add a stored file as a model and have it probed; the same again changes nothing.

    Raises Conflict when the name stands for another file, or the file has another name already.
    """
    other = repository.model_of_content(session, file.sha256)
    if other is not None and other.name != name:
        raise Conflict(f"this file is here already, as the model {other.name!r}; use that one")
    model_id = repository.add_model(
        session,
        {
            "name": name,
            "family": family,
            "sha256": file.sha256,
            "size_bytes": file.size_bytes,
            "status": ModelStatus.PROBING,
            "signature": {},
            "created_by_id": user_id,
        },
    )
    if model_id is None:
        return AddedModel(_same_model(session, name, family, file.sha256), created=False)
    # Ids of deleted models may come again; job ids never do.
    job_id = f"{PROBE_JOB}-{model_id}-{uuid.uuid4().hex[:12]}"
    jobs.enqueue(session, PROBE_JOB, model_id, queue=JobQueue.SHORT, job_id=job_id)
    return AddedModel(get_model(session, model_id), created=True)


def add_model_file(
    database: Database,
    storage: Storage,
    jobs: JobClient,
    path: Path,
    *,
    name: str,
    family: str,
    max_bytes: int = _DEFAULT_MAX_BYTES,
) -> AddedModel:
    """Add a model from a file on this machine; a running worker probes it."""
    name, family = checked_name(name), checked_family(family)
    with path.open("rb") as stream:
        file = store_file(storage, stream, max_bytes=max_bytes)
    with database.writing() as session:
        return add_model(session, jobs, file, name=name, family=family)


def model_id_of_job(job_id: str) -> int | None:
    """Return which model a job probes; None for another job."""
    prefix, _, rest = job_id.partition("-")
    number, _, _ = rest.partition("-")
    return int(number) if prefix == PROBE_JOB and number.isdigit() else None


def get_model(session: Session, model_id: int) -> Model:
    """Return a model. Raises NotFound."""
    model = repository.model(session, model_id)
    if model is None:
        raise NotFound(NO_MODEL)
    return model


def list_models(
    session: Session, paging: Paging, status: ModelStatus | None = None
) -> tuple[Sequence[Model], str | None]:
    """Return a part of the list of models, oldest first, and the next cursor."""
    return repository.models(session, paging, status)


def all_models(session: Session) -> Sequence[Model]:
    """Return all models by name."""
    return repository.all_models(session)


def count_uses(session: Session, model: Model) -> tuple[int, int]:
    """Return how many runs use a model and how many images it has looked at."""
    return repository.count_runs(session, model.id), repository.count_sets(session, model.sha256)


def require_unused(session: Session, model: Model) -> None:
    """Raise Conflict while a run or a standing run uses a model."""
    runs = repository.count_runs(session, model.id)
    if runs:
        raise Conflict(f"{runs} runs use this model; their poses would lose their origin")
    if repository.is_standing(session, model.id):
        raise Conflict("a standing run uses this model; remove that one first")


def finish_probe(
    session: Session, model_id: int, *, reason: str | None, signature: dict[str, object] | None
) -> None:
    """Say what the probe found: ready with a signature and its family, or refused for a reason."""
    status = ModelStatus.READY if reason is None else ModelStatus.REFUSED
    signature = signature or {}
    family = signature.get("family")
    repository.set_outcome(
        session, model_id, status, reason, signature, str(family) if family in FAMILIES else None
    )


@contextmanager
def local_file(storage: Storage, sha256: str) -> Iterator[Path]:
    """Give a path to a stored file; from a bucket it is fetched while the block lasts."""
    path = storage.local_path(sha256)
    if path is not None:
        yield path
        return
    with storage.open(sha256) as source, tempfile.NamedTemporaryFile(suffix=".onnx") as copy:
        while chunk := source.read(_CHUNK_BYTES):
            copy.write(chunk)
        copy.flush()
        yield Path(copy.name)


def _same_model(session: Session, name: str, family: str, sha256: str) -> Model:
    model = repository.model_of_name(session, name)
    if model is None:
        raise Conflict(f"the model {name!r} was deleted just now; send it again")
    if model.sha256 != sha256 or (AUTO not in {family, model.family} and model.family != family):
        raise Conflict(f"another model has the name {name!r} already; choose another name")
    return model
