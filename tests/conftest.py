"""Fixtures shared by all tests."""

from pathlib import Path

import pytest
import structlog
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parents[1]
TOGETHER = "tests/browser/"


class _OneBrowser(LoadScopeScheduling):
    """Sends each test to whichever process is free, but all browser tests to the same one.

    They share a server, a worker and a browser, whose start costs more than any of them.
    (`--dist loadgroup` would do, but pytest-xdist 3.8 finds no groups under pytest 9.2.)
    """

    def _split_scope(self, nodeid: str) -> str:
        return TOGETHER if nodeid.startswith(TOGETHER) else nodeid


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadScopeScheduling:
    """Choose how tests are spread over processes."""
    return _OneBrowser(config, log)


@pytest.fixture(scope="session", autouse=True)
def _short_tracebacks() -> None:
    """Log errors without the values of all variables: to print those takes many seconds."""
    plain = structlog.dev.ConsoleRenderer(exception_formatter=structlog.dev.plain_traceback)
    structlog.configure(processors=[*structlog.get_config()["processors"][:-1], plain])


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """Real photographs, labels, recordings and weights beside the checkout."""
    path = ROOT.parent / "shared"
    if not path.is_dir():
        pytest.skip("needs ../shared: real photographs, AIS recordings and weights")
    return path
