"""Trying a new model out, in a child process that may die of it."""

from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.detectors import service
from app.errors import NotFound
from app.jobs import JobRunner
from app.storage import Storage
from worker.inference.probe import ProbeResult, probe


class ProbeModel:
    """Does the jobs that make a new model ready, or refuse it with a reason."""

    job = service.PROBE_JOB

    def __init__(
        self,
        runner: JobRunner,
        database: Database,
        storage: Storage,
        settings: Settings,  # noqa: ARG002  all tasks are made alike
    ) -> None:
        self._runner = runner
        self._database = database
        self._storage = storage

    def do(self, model_id: int) -> None:
        """Probe a model; a deleted one is left alone."""
        self._runner.step("probe", self._probe, model_id)

    def fail(self, reason: str, model_id: int) -> None:
        """Refuse a model whose probe failed for a reason of ours."""
        service.finish_probe(self._runner.session(), model_id, reason=reason, signature=None)

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Refuse a model whose probe is not tried again."""
        model_id = service.model_id_of_job(job_id)
        if model_id is not None:
            service.finish_probe(session, model_id, reason=reason, signature=None)

    def _probe(self, model_id: int) -> None:
        result = self._result(model_id)
        if result is not None:
            service.finish_probe(
                self._runner.session(), model_id, reason=result.reason, signature=result.signature
            )

    def _result(self, model_id: int) -> ProbeResult | None:
        with self._database.reading() as session:
            try:
                model = service.get_model(session, model_id)
            except NotFound:
                return None
        with service.local_file(self._storage, model.sha256) as path:
            return probe(path, model.family)
