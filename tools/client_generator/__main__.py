"""`python -m tools.client_generator` writes `quaymark/client/rest`, which git ignores."""

import json
import shutil
import sys
import tempfile
from pathlib import Path

from openapi_python_client import generate
from openapi_python_client.config import Config, ConfigFile, MetaType

from app.main import build_routes
from tools.client_generator.document import for_client

ROOT = Path(__file__).resolve().parents[2]
TEMPLATES = Path(__file__).parent / "templates"
TARGET = ROOT / "quaymark" / "client" / "rest"


def main() -> int:
    """Generate the client; returns 1 with what the generator complains of."""
    with tempfile.TemporaryDirectory(dir=TARGET.parent) as folder:
        source, made = Path(folder) / "openapi.json", Path(folder) / "rest"
        source.write_text(json.dumps(for_client(build_routes().openapi())))
        complaints = generate(config=_config(source, made), custom_template_path=TEMPLATES)
        for complaint in complaints:
            sys.stderr.write(f"{complaint.header}\n{complaint.detail}\n")
        if complaints:
            return 1
        for left_over in ("client.py", "errors.py"):  # connection.py stands in for both
            (made / left_over).unlink()
        shutil.rmtree(TARGET, ignore_errors=True)
        made.rename(TARGET)
    return 0


def _config(source: Path, target: Path) -> Config:
    chosen = ConfigFile(
        project_name_override="quaymark.client.rest",
        package_name_override="quaymark.client.rest",
        post_hooks=[],
        literal_enums=True,
        content_type_overrides={
            "application/geo+json": "application/json",
            "text/csv": "application/octet-stream",
        },
    )
    return Config.from_sources(chosen, MetaType.NONE, source, "utf-8", True, target)


if __name__ == "__main__":
    sys.exit(main())
