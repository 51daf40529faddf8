"""Every operation of the OpenAPI document, asked what it does not expect.

Schemathesis draws requests from the document, fitting ones and broken ones; the ids in them are
replaced, mostly, by those of things that exist, so that requests get past the look-up. No answer
may be a server's error, and each must be one that the document tells: its status, its kind of
content, its headers, its shape. `QUAYMARK_SCHEMATHESIS_EXAMPLES` asks for more than a few.
"""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import schemathesis
import sqlalchemy as sa
from fastapi import FastAPI
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import Case, GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from app.config import Settings
from app.db import Database
from app.main import build_routes, furnish
from app.tables.runs import Run, RunStatus
from tests.factories import identity
from tests.factories.world import make_world

EXAMPLES = int(os.environ.get("QUAYMARK_SCHEMATHESIS_EXAMPLES", "2"))
PATIENT_S = 120.0  # a busy machine is no error
SHARES = 4  # operations are asked in as many tests, which may run in different processes
CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]
# It says 503, and the document with it, as long as no worker lives.
OF_THE_INSTALLATION = "GET /readyz"
VERSIONS = ('"1"', '"1"', '"7"', "x", None)


class Stage:
    """An application with one of everything, as new for each operation."""

    def __init__(self, app: FastAPI, template: Path, folder: Path) -> None:
        self.app = app
        self._folder = folder
        self._world = folder / "world.db"
        shutil.copy(template, self._world)
        database = Database(f"sqlite:///{self._world}")
        with database.writing() as session:
            self.ids = make_world(session, "Elbe", 211000001)
            session.execute(sa.update(Run).values(status=RunStatus.SUCCEEDED))  # its events end
            admin = identity.make_user(session, "admin")
            person = identity.make_user(session, "viewer", self.ids["site_id"])
            self.headers = {"Authorization": f"Bearer {identity.make_token(session, admin)}"}
        self.ids |= {"user_id": person.id, "token_id": 1, "session_id": 1, "invitation_id": 1}
        database.dispose()
        self.renew()

    def renew(self) -> None:
        """Put everything back as it was."""
        if hasattr(self.app.state, "database"):
            self.app.state.jobs.destroy()
            self.app.state.database.dispose()
        for left in self._folder.glob("now.db*"):
            left.unlink()
        shutil.copy(self._world, self._folder / "now.db")
        furnish(
            self.app,
            Settings(
                data_dir=self._folder,
                database_url=f"sqlite:///{self._folder / 'now.db'}",
                storage_url=str(self._folder / "files"),
            ),
        )

    def with_ids(self, value: Any) -> Any:
        """Return a generated value with the ids of existing things where their names stand."""
        if isinstance(value, dict):
            return {key: self.ids.get(key, self.with_ids(part)) for key, part in value.items()}
        return [self.with_ids(part) for part in value] if isinstance(value, list) else value


@pytest.fixture(scope="module")
def stage(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    """Give the application, whose routes are its own: another one may be in use elsewhere."""
    made = Stage(build_routes(), sqlite_template, tmp_path_factory.mktemp("openapi"))
    yield made
    made.app.state.jobs.destroy()
    made.app.state.database.dispose()


@pytest.mark.parametrize("share", range(SHARES))
def test_every_operation_answers_as_documented(stage: Stage, share: int) -> None:
    """Requests that nobody foresaw get an answer which the OpenAPI document foresees."""
    schema = schemathesis.openapi.from_asgi("/api/v1/openapi.json", stage.app)
    operations = [found.ok() for found in schema.get_all_operations()]
    assert len(operations) > 200
    for operation in operations[share::SHARES]:
        if operation.label != OF_THE_INSTALLATION:
            ask(stage, operation)
            stage.renew()


def ask(stage: Stage, operation: Any) -> None:
    """Ask an operation with fitting and with broken requests."""
    fitting = operation.as_strategy(generation_mode=GenerationMode.POSITIVE)
    broken = operation.as_strategy(generation_mode=GenerationMode.NEGATIVE)

    @settings(
        max_examples=EXAMPLES,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.explicit, Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(
        case=st.one_of(fitting, fitting, broken),
        known=st.sampled_from((True, True, True, False)),
        version=st.sampled_from(VERSIONS),
    )
    def answers_as_documented(case: Case, known: bool, version: str | None) -> None:  # noqa: FBT001
        if known:
            case.path_parameters = stage.with_ids(dict(case.path_parameters or {}))
            case.query = stage.with_ids(dict(case.query or {}))
            case.body = stage.with_ids(case.body)
        headers = stage.headers | ({} if version is None else {"If-Match": version})
        case.call_and_validate(headers=headers, checks=CHECKS, timeout=PATIENT_S)

    answers_as_documented()
