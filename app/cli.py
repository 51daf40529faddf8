"""The `quaymark` command: everything that needs a shell instead of a browser.

Each group of commands lives with its feature, in `commands.py`; this module puts them together and
turns errors meant for users into one line on stderr.
"""

import sys

import click
import typer

from app import __version__
from app.ais import commands as ais
from app.auth import commands as auth
from app.detectors import commands as detectors
from app.errors import AppError
from app.exports import commands as exports
from app.imagery import commands as imagery
from app.operation import commands as operation
from app.runs import commands as runs

cli = typer.Typer(
    name="quaymark",
    help="Shore-camera photographs and AIS messages, fused into reviewed 6D vessel poses.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

imports = typer.Typer(name="import", help="Bring in images, AIS recordings and detections.")
ais.register(cli, imports)
imagery.register(imports)
detectors.register(cli, imports)
cli.add_typer(imports)
auth.register(cli)
runs.register(cli)
exports.register(cli)
operation.register(cli)


@cli.command()
def version() -> None:
    """Print the version."""
    typer.echo(__version__)


def main() -> None:
    """Run the command; exit 0 on success, 2 on bad arguments, 1 on failure with one line."""
    try:
        code = cli(standalone_mode=False)
    except click.UsageError as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(1)
    except AppError as error:
        typer.echo(f"quaymark: {error.detail}", err=True)
        sys.exit(1)
    sys.exit(code if isinstance(code, int) else 0)
