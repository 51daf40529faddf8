"""The README says what is true: its commands and settings are those of the code."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from app.cli import cli
from app.config import Settings

ROOT = Path(__file__).resolve().parents[3]
README = (ROOT / "README.md").read_text()
COMMANDS = re.findall(r"(?:^ {4}|\$\(|`)quaymark ([^`#)\n]+)", README, re.MULTILINE)


def test_every_setting_is_documented_and_no_other() -> None:
    """The table of settings names each QUAYMARK_ variable that the code reads."""
    known = {f"QUAYMARK_{name.upper()}" for name in Settings.model_fields}

    assert set(re.findall(r"QUAYMARK_[A-Z_]+", README)) == known


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_exists_with_its_options(line: str) -> None:
    """Each `quaymark ...` of the README is a command, and the options it shows are its own."""
    words = shlex.split(line)
    command = get_command(cli)
    while words and words[0] in getattr(command, "commands", {}):
        command = command.commands[words.pop(0)]

    assert not hasattr(command, "commands"), f"{line!r} is no command"
    options = {option for parameter in command.params for option in parameter.opts}
    assert {word for word in words if word.startswith("-")} <= options


def test_files_that_are_linked_exist() -> None:
    """Relative links lead to files of the checkout."""
    links = re.findall(r"\]\(([^):]+)\)", README)

    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
