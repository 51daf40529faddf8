"""What an anonymised export says of vessels, and of files that are named after them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.pseudonyms import is_pseudonym, pseudonym
from app.exports.identities import Hidden, Shown

SECRET = b"s" * 32
VESSELS = [(211234560, "Cap San Diego"), (2655123, None), (211000002, "Bö"), (211000003, "K-7")]
SHA256 = "ab" * 32


@given(st.integers(0, 999_999_999), st.integers(0, 999_999_999))
def test_pseudonyms_are_stable_and_tell_vessels_apart(one: int, other: int) -> None:
    """The same vessel has the same pseudonym, others another, and none holds the MMSI."""
    assert pseudonym(one, SECRET) == pseudonym(one, SECRET)
    assert (pseudonym(one, SECRET) == pseudonym(other, SECRET)) == (one == other)
    assert is_pseudonym(pseudonym(one, SECRET))


def test_another_site_has_other_pseudonyms() -> None:
    """Two sites' data sets cannot be joined over them."""
    assert pseudonym(211234560, SECRET) != pseudonym(211234560, b"t" * 32)


@pytest.mark.parametrize(
    "name",
    [
        "211234560.jpg",
        "20220714102030211234560.jpg",
        "002655123 at noon.png",
        "CAP_SAN_DIEGO-3.JPG",
        "capsandiego.jpeg",
        "the cap san. diego.jpg",
    ],
)
def test_a_file_name_that_tells_a_vessel_is_replaced(name: str) -> None:
    """MMSI and names are found however they are written; the suffix stays for the reader."""
    shown = Hidden(SECRET, VESSELS).file_name(name, SHA256)
    assert shown == SHA256 + name[name.rindex(".") :]


@pytest.mark.parametrize(
    "name", ["20220714_102030.jpg", "00139255c1d7dd9c.jpg", "Bö.jpg", "no suffix", "k.7.jpg", ""]
)
def test_other_file_names_stay(name: str) -> None:
    """Names by time or hash are how people find the file; two letters tell no vessel."""
    assert Hidden(SECRET, VESSELS).file_name(name, SHA256) == name


def test_neither_folder_nor_suffix_tells_a_vessel() -> None:
    """What stands before and behind a file's name is a part of what is told."""
    hidden = Hidden(SECRET, VESSELS)
    assert hidden.file_name("Cap San Diego/1.jpg", SHA256) == f"{SHA256}.jpg"
    assert hidden.file_name("1.CapSanDiego", SHA256) == SHA256


def test_shown_identities_are_as_they_are() -> None:
    """With identities the MMSI and all file names stay."""
    assert Shown().vessel(211234560) == "211234560"
    assert Shown().file_name("211234560.jpg", SHA256) == "211234560.jpg"
