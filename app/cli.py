"""The `quaymark` command: everything that needs a shell instead of a browser.

Each group of commands lives with its feature, in `commands.py`; this module puts them together and
turns errors meant for users into one line on stderr. What a command needs is imported when it runs,
so that `--help` answers at once.
"""

import errno
import sys

import typer

from app import __version__, bonk
from app.ais import commands as ais
from app.auth import commands as auth
from app.detectors import commands as detectors
from app.errors import AppError
from app.exports import commands as exports
from app.groundtruth import commands as ground_truth
from app.imports import commands as bulk_imports
from app.keeping import commands as keeping
from app.operation import commands as operation
from app.runs import commands as runs

NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})

cli = typer.Typer(
    name="quaymark",
    help="Shore-camera photographs and AIS messages, fused into reviewed 6D vessel poses.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

imports = typer.Typer(
    name="import", help="Bring in images, AIS recordings and detections.", no_args_is_help=True
)
bulk_imports.register(imports)
ais.register(cli, imports)
detectors.register(cli, imports)
bonk.register(imports)
ground_truth.register(cli, imports)
cli.add_typer(imports)
auth.register(cli)
runs.register(cli)
exports.register(cli)
keeping.register(cli)
operation.register(cli)


@cli.command()
def version() -> None:
    """Print the version."""
    typer.echo(__version__)


def main() -> None:
    """Run the command; exit 0 on success, 2 on bad arguments, 1 on failure with one line."""
    try:
        cli()
    except AppError as error:
        _fail(error.detail)
    except Exception as error:
        line = _told_by_others(error)
        if line is None:
            raise
        _fail(line)


def _fail(line: str) -> None:
    typer.echo(f"quaymark: {line}", err=True)
    sys.exit(1)


def _told_by_others(error: Exception) -> str | None:
    """Return one line for what libraries say about things a user can mend; None for our bugs."""
    # They are loaded already when they have raised something.
    from pydantic import ValidationError
    from sqlalchemy.exc import OperationalError

    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        name = f"QUAYMARK_{field.upper()}" if error.title == "Settings" and field else field
        message = str(first["msg"]).removeprefix("Value error, ")
        return f"{name}: {message}" if name else message
    if isinstance(error, OperationalError):
        return f"the database cannot be used: {str(error.orig).strip().splitlines()[0]}"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        return f"what was to be written did not fit: {error.strerror}"
    return None
