"""The command line on each of the two databases."""

from typing import Protocol

import pytest

from app.config import Settings
from tests.shell import Outcome, run_quaymark


class Shell(Protocol):
    """Runs `quaymark` on the test's own installation."""

    def __call__(self, *arguments: object, stdin: str = "", terminal: bool = False) -> Outcome:
        """Return what the command left behind."""


@pytest.fixture
def quaymark(settings: Settings) -> Shell:
    """Give the command, on a fresh, migrated database."""
    environment = {
        "QUAYMARK_DATA_DIR": str(settings.data_dir),
        "QUAYMARK_DATABASE_URL": settings.database_url,
        "QUAYMARK_STORAGE_URL": settings.storage_url,
    }

    def run(*arguments: object, stdin: str = "", terminal: bool = False) -> Outcome:
        words = [str(argument) for argument in arguments]
        return run_quaymark(*words, environment=environment, stdin=stdin, terminal=terminal)

    return run
