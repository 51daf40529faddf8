"""`quaymark import ais` and `ais inspect` on zip archives."""

import json
from pathlib import Path

from tests.factories.ais import table
from tests.factories.archives import HOSTILE, zipped
from tests.integration.commands.conftest import Shell

TEXTS = ("dma_aislib_small_mixed_tagblocks.txt", "dma_219165000_22min_pghp_and_suffix.ais")


def test_inspecting_an_archive_tells_the_sum(
    quaymark: Shell, shared_dir: Path, tmp_path: Path
) -> None:
    """An archive of two real recordings is told exactly as the two side by side."""
    paths = [shared_dir / "real/ais" / name for name in TEXTS]
    archive = tmp_path / "both.zip"
    archive.write_bytes(zipped({path.name: path.read_bytes() for path in paths}))
    packed, apart = (
        quaymark("ais", "inspect", archive, "--json"),
        quaymark("ais", "inspect", *paths, "--json"),
    )

    assert (packed.code, apart.code) == (0, 0), packed.error + apart.error
    told, expected = json.loads(packed.out), json.loads(apart.out)
    assert (told.pop("formats"), expected.pop("formats")) == (["zip(nmea)"], ["nmea"])
    assert told == expected


def test_a_bad_archive_costs_itself_alone(quaymark: Shell, tmp_path: Path) -> None:
    """Archives are imported and known again; hostile ones are named with their entry, exit 1."""
    folder = tmp_path / "sent"
    folder.mkdir()
    good, parent, bomb = (folder / f"{name}.zip" for name in ("good", "parent", "bomb"))
    good.write_bytes(zipped({"a.csv": table(2)}))
    parent.write_bytes(HOSTILE["parent"][0])
    bomb.write_bytes(HOSTILE["bomb"][0])
    outcome = quaymark("import", "ais", folder)
    again = quaymark("import", "ais", good)

    assert outcome.code == 1
    assert outcome.out.startswith(f"imported {good}: ")
    assert "positions 2" in outcome.out
    assert f"refused {parent}: file: its entry '../up.csv'" in outcome.error
    assert f"refused {bomb}: the archive's entry 'bomb.csv'" in outcome.error
    assert "2 of 3 recordings were refused" in outcome.error
    assert again.out.startswith(f"known {good}: ")
