"""Zip archives from strangers: what is let through is exactly what was put in."""

import io
import os
import tracemalloc
import zipfile
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app import archives
from app.archives import Limits
from app.errors import AppError, Invalid, TooLarge
from tests.factories.archives import HOSTILE, sharing_bytes, zipped

LIMITS = Limits(unfolded_bytes=1 << 24)
NAMES = st.from_regex(r"[A-Za-z0-9äß _.-]{1,12}(/[a-z]{1,5})?", fullmatch=True).filter(
    lambda name: ".." not in name.split("/") and not name.endswith(".DS_Store")
)
FILES = st.dictionaries(NAMES, st.binary(max_size=300).map(lambda data: b"!" + data), max_size=4)
METHODS = st.sampled_from([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])


def unfolded(data: bytes, limits: Limits = LIMITS) -> dict[str, bytes]:
    """Return an archive's files."""
    return {name: text.read() for name, text in archives.entries(io.BytesIO(data), limits)}


@given(files=FILES, method=METHODS)
def test_what_was_put_in_comes_out(files: dict[str, bytes], method: int) -> None:
    """Names and bytes of every file come back, in the archive's order."""
    found = unfolded(zipped(files, method=method))
    assert list(found.items()) == list(files.items())


@given(files=FILES, method=METHODS, part=st.floats(0, 1, exclude_max=True))
def test_an_archive_that_is_cut_off_is_refused(
    files: dict[str, bytes], method: int, part: float
) -> None:
    """Wherever a transfer broke off, nothing is taken for the whole."""
    whole = zipped(files, method=method)
    with pytest.raises(Invalid):
        unfolded(whole[: int(part * len(whole))])


@given(files=FILES, method=METHODS, place=st.floats(0, 1, exclude_max=True), byte=st.binary())
def test_a_wrong_byte_never_becomes_a_wrong_file(
    files: dict[str, bytes], method: int, place: float, byte: bytes
) -> None:
    """One changed byte anywhere: the archive is refused, or its files are the true ones."""
    whole = zipped(files, method=method)
    at = int(place * len(whole))
    try:
        found = unfolded(whole[:at] + byte[:1] + whole[at + 1 :])
    except (Invalid, TooLarge):
        return
    assert found == files


@given(rubbish=st.binary(max_size=400))
def test_rubbish_is_refused(rubbish: bytes) -> None:
    """Bytes that only begin like an archive are refused, whatever follows."""
    with pytest.raises(AppError):
        unfolded(b"PK\x03\x04" + rubbish)


@pytest.mark.parametrize(
    "case", [case for case in HOSTILE if case not in {"text", "empty", "only folders"}]
)
def test_hostile_archives_are_refused_with_their_entry_named(case: str) -> None:
    """Each attack gets its status, and the answer names the entry."""
    data, status, named = HOSTILE[case]
    with pytest.raises(AppError) as refused:
        unfolded(data)
    assert (refused.value.status, named in refused.value.detail) == (status, True)


def test_names_are_judged_before_any_entry_is_handed_out() -> None:
    """A bad last entry is told when the archive is opened, not after the good ones."""
    data, _, _ = HOSTILE["parent"]
    with pytest.raises(Invalid):
        archives.entries(io.BytesIO(data), LIMITS)


def test_what_systems_add_is_passed_over() -> None:
    """Folders and the hidden files of macOS are no content."""
    data = zipped(
        {"a/": b"", "a/b.csv": b"text", "__MACOSX/a/._b.csv": b"x", "a/.DS_Store": b"x"},
    )
    assert unfolded(data) == {"a/b.csv": b"text"}


def test_the_limits_are_the_callers() -> None:
    """Just at a limit an archive comes in, one byte, entry or fold beyond it does not."""
    data = zipped({"a": b"xyz", "b": b"xyz"})
    assert unfolded(data, Limits(unfolded_bytes=6, entries=2)) == {"a": b"xyz", "b": b"xyz"}
    with pytest.raises(TooLarge, match="more than 5 bytes"):
        unfolded(data, Limits(unfolded_bytes=5))
    with pytest.raises(TooLarge, match="more than 1 entries"):
        unfolded(data, Limits(unfolded_bytes=6, entries=1))
    folded = zipped({"a": b"ab" * 100_000})
    assert len(unfolded(folded, Limits(unfolded_bytes=1 << 20, ratio=1_000))["a"]) == 200_000
    with pytest.raises(TooLarge, match="more than 100 times"):
        unfolded(folded, Limits(unfolded_bytes=1 << 20))


def test_what_the_caller_leaves_unread_is_checked_all_the_same() -> None:
    """Damage shows also in an entry whose reader stopped after its first byte."""
    data = zipped({"a": os.urandom(1 << 20)}, method=zipfile.ZIP_STORED)
    at = len(data) - 200
    damaged = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
    found = archives.entries(io.BytesIO(damaged), LIMITS)
    _, text = next(found)
    assert len(text.read(1)) == 1
    with pytest.raises(Invalid, match="'a' is damaged"):
        next(found)


def test_an_entry_can_be_read_again_from_its_beginning() -> None:
    """Readers that look at the first bytes and go back get all of them, checksum included."""
    content = os.urandom(1 << 20)
    for _, text in archives.entries(io.BytesIO(zipped({"a": content})), LIMITS):
        assert text.read(1 << 19) == content[: 1 << 19]
        text.seek(0)
        assert text.read() == content


def test_memory_stays_flat(tmp_path: Path) -> None:
    """32 MB pass through a few hundred kilobytes; a directory of 100,000 entries is not loaded."""
    block = os.urandom(1 << 15).hex().encode()
    path = tmp_path / "large.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a", "w") as out:
        for _ in range(512):
            out.write(block)
    many = io.BytesIO(sharing_bytes("a", b"", 100_000))
    tracemalloc.start()
    try:
        with path.open("rb") as stream:
            found = archives.entries(stream, Limits(unfolded_bytes=1 << 26))
            _, text = next(found)
            total = sum(map(len, iter(partial(text.read, 1 << 16), b"")))
        with pytest.raises(TooLarge):
            archives.entries(many, LIMITS)
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert total == 512 * len(block) == 1 << 25
    assert peak_bytes < 4 << 20
