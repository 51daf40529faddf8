"""What the command line says when something is wrong, and how it ends."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from app.cli import cli
from tests.shell import run_quaymark

HEAVY = {"sqlalchemy", "fastapi", "numpy", "cv2", "dbos", "pydantic", "alembic", "scipy"}


def all_commands() -> list[tuple[str, ...]]:
    """Return the words of every command and group."""

    def below(command: object, words: tuple[str, ...]) -> list[tuple[str, ...]]:
        found = [words]
        for name, child in getattr(command, "commands", {}).items():
            found += below(child, (*words, name))
        return found

    return below(get_command(cli), ())


@pytest.mark.parametrize("words", all_commands(), ids=" ".join)
def test_every_command_explains_itself(words: tuple[str, ...]) -> None:
    """--help works on all, without an installation to work on."""
    outcome = run_quaymark(*words, "--help", environment={"QUAYMARK_DATABASE_URL": "nonsense"})

    assert outcome.code == 0, outcome.error
    assert "Usage: quaymark" in outcome.out


def test_help_loads_nothing_heavy() -> None:
    """What only some commands need is not loaded before one of them runs."""
    names = ", ".join(f"{name!r}" for name in sorted(HEAVY))
    code = f"import sys, app.cli; print(*({{{names}}} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert not done.stdout.split()


def test_a_database_without_tables_is_refused_with_the_remedy(tmp_path: Path) -> None:
    """A command on a database that is not migrated says what to run, in one line."""
    outcome = run_quaymark("user", "list", environment={"QUAYMARK_DATA_DIR": str(tmp_path)})

    assert outcome.code == 1
    assert outcome.error.count("\n") == 1
    assert "quaymark db upgrade" in outcome.error


@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({"QUAYMARK_PORT": "many"}, "QUAYMARK_PORT: "),
        ({"QUAYMARK_ENVIRONMENT": "production"}, "QUAYMARK_SECRET_KEY must be at least"),
        (
            {"QUAYMARK_DATABASE_URL": "postgresql://nobody@127.0.0.1:1/none"},
            "the database cannot be used: ",
        ),
    ],
)
def test_a_wrong_setting_is_one_line(environment: dict[str, str], words: str) -> None:
    """A setting that cannot work is named in one line, with exit code 1."""
    outcome = run_quaymark("model", "list", environment=environment)

    assert outcome.code == 1
    assert outcome.error.startswith(f"quaymark: {words}")
    assert outcome.error.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ("sail",),
        ("import", "images", "1", "/nowhere/at/all"),
        ("import", "images", "east", "."),
        ("export", "--format", "xml", "--out", "poses.xml"),
        ("export", "--format", "coco", "--out", "poses.json", "--grade", "splendid"),
        ("model", "pull", "yolov8"),
        ("model", "add", "/dev/null", "--family", "yolov8", "--name", "x"),
        ("run", "--viewport", "1", "--preset", "guess"),
        ("fuse", "--camera", "camera.json"),
    ],
    ids=" ".join,
)
def test_bad_arguments_end_with_2(words: tuple[str, ...], tmp_path: Path) -> None:
    """Arguments that can never be right exit with 2, and nothing is made of them."""
    outcome = run_quaymark(*words, environment={"QUAYMARK_DATA_DIR": str(tmp_path / "data")})

    assert outcome.code == 2
    assert outcome.error
    assert not outcome.out
