"""Addresses that users name: what lies inside is refused, whatever it is called."""

import socket

import pytest

from app import addresses
from app.addresses import AddressError, ForbiddenAddressError, check_host, check_local, resolve


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1",
        "127.1",
        "0x7f000001",
        "2130706433",
        "0177.0.0.1",
        "localhost",
        "0",
        "[::1]",
        "::ffff:127.0.0.1",
        "::127.0.0.1",
        "64:ff9b::a9fe:a9fe",
        "2002:a9fe:a9fe::",
        "169.254.169.254",
        "fd00:ec2::254",
        "168.63.129.16",
        "10.0.0.1",
        "172.16.0.1",
        "192.168.1.1",
        "100.64.0.1",
        "fe80::1",
        "224.0.0.1",
        "255.255.255.255",
    ],
)
def test_what_lies_inside_is_refused(host: str) -> None:
    """Loopback, private, link-local, shared and metadata addresses in every spelling."""
    with pytest.raises(ForbiddenAddressError, match="QUAYMARK_FEED_ALLOWED_NETWORKS"):
        resolve(host, 5631, [])


@pytest.mark.parametrize("host", ["8.8.8.8", "[2001:4860:4860::8888]"])
def test_what_lies_outside_may_be_connected_to(host: str) -> None:
    """A public address is allowed as it stands."""
    assert resolve(host, 5631, []).ip == host.strip("[]")


def test_a_network_of_ones_own_can_be_allowed() -> None:
    """An allowed network opens itself and nothing beside it, mapped forms included."""
    allowed = ["192.168.7.0/24"]
    assert str(resolve("192.168.7.9", 5631, allowed)) == "192.168.7.9:5631"
    assert resolve("::ffff:192.168.7.9", 5631, allowed).port == 5631
    with pytest.raises(ForbiddenAddressError):
        resolve("192.168.8.9", 5631, allowed)


def test_a_name_is_resolved_once_and_all_it_leads_to_is_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A name server that answers differently the second time is never asked a second time."""
    answers = [["8.8.8.8"], ["8.8.4.4", "127.0.0.1"]]

    def answer(_host: str, port: int, **_kind: object) -> list[tuple[object, ...]]:
        return [(socket.AF_INET, 1, 6, "", (ip, port)) for ip in answers.pop(0)]

    monkeypatch.setattr(addresses.socket, "getaddrinfo", answer)
    assert resolve("rebinding.example", 80, []).ip == "8.8.8.8"
    assert len(answers) == 1
    with pytest.raises(ForbiddenAddressError):
        resolve("rebinding.example", 80, [])


@pytest.mark.parametrize("host", ["", "a b", "user@host", "host/path", "host?x", "fe80::1%eth0"])
def test_what_is_no_host_is_refused(host: str) -> None:
    """Only names and numbers are hosts."""
    with pytest.raises(AddressError):
        check_host(host)


@pytest.mark.parametrize("host", ["ais.example.org", "224.0.0.1", "fe80::1", "255.255.255.255"])
def test_only_addresses_of_this_machine_are_listened_on(host: str) -> None:
    """A listener takes a number that one machine can have."""
    with pytest.raises(AddressError):
        check_local(host)
