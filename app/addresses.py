"""Addresses outside: which of them this installation connects to on a user's word.

A server that connects wherever a user says can be sent to its own database, its neighbours or the
cloud's metadata service, which nobody outside could reach. So a name is resolved once, every
address it leads to is judged, and the connection goes to a judged address as a number: a name that
leads elsewhere a moment later (DNS rebinding) gains nothing. What is judged is the number the
system resolved, so that odd spellings (`127.1`, `0x7f000001`, `::ffff:127.0.0.1`) get no further
than plain ones. Networks of one's own are allowed by configuration.
"""

import re
import socket
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network

IpAddress = IPv4Address | IPv6Address
_HOST = re.compile(r"[A-Za-z0-9._-]{1,253}|\[?[0-9A-Fa-f:.]{2,45}\]?")
# Beyond what `is_global` refuses: addresses that stand for others, and a cloud's service host.
_NEVER_MEANT = tuple(
    ip_network(network)
    for network in ("192.88.99.0/24", "168.63.129.16/32", "fec0::/10", "64:ff9b:1::/48")
)
_UNANSWERED = (socket.EAI_AGAIN, socket.EAI_FAIL, socket.EAI_SYSTEM)
_NAT64 = ip_network("64:ff9b::/96")


class AddressError(ValueError):
    """An address that cannot be used; the message says why, and what to do."""


class UnansweredError(AddressError):
    """A name of which nobody could be asked just now; the name may well be right."""


class ForbiddenAddressError(AddressError):
    """An address inside: this machine, its network, a cloud's metadata."""


@dataclass(frozen=True, slots=True)
class Destination:
    """A judged address to connect to, as a number."""

    ip: str
    port: int

    def __str__(self) -> str:
        return f"[{self.ip}]:{self.port}" if ":" in self.ip else f"{self.ip}:{self.port}"


def check_host(host: str) -> str:
    """Return a host as it may be stored. Raises AddressError for what is neither name nor number.

    A zone (`fe80::1%eth0`), a port, a path or a user before `@` is no part of a host.
    """
    host = host.strip()
    if not _HOST.fullmatch(host):
        raise AddressError("give a host name or an IP address, without a port or a path")
    return host.removeprefix("[").removesuffix("]")


def resolve(host: str, port: int, allowed_networks: Sequence[str]) -> Destination:
    """Resolve a host once and return an address that may be connected to; see `resolve_all`."""
    return resolve_all(host, port, allowed_networks)[0]


def resolve_all(host: str, port: int, allowed_networks: Sequence[str]) -> list[Destination]:
    """Resolve a host once and return its addresses, which may be connected to, the best first.

    Raises ForbiddenAddressError if any of them lies inside and is in no allowed network,
    UnansweredError if no name server answers, AddressError if there is none. Takes as long as name
    servers do: not for the middle of a transaction.
    """
    try:
        found = socket.getaddrinfo(check_host(host), port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        if isinstance(error, socket.gaierror) and error.errno in _UNANSWERED:
            raise UnansweredError(
                f"no name server answers for {host}; check its spelling and this machine's network"
            ) from error
        raise AddressError(f"no address is known for {host}; check its spelling") from error
    addresses = list(dict.fromkeys(str(entry[4][0]) for entry in found))
    judge(addresses, allowed_networks)
    return [Destination(address, port) for address in addresses]


def judge(addresses: Iterable[str], allowed_networks: Sequence[str]) -> None:
    """Raise ForbiddenAddressError for the first of these addresses that lies inside."""
    networks = [ip_network(network) for network in allowed_networks]
    for text in addresses:
        if "%" in text:
            raise ForbiddenAddressError(_told(text))
        address = ip_address(text)
        meant = _meant(address)
        if any(one in network for network in networks for one in (address, meant)):
            continue
        if not _is_outside(address) or not _is_outside(meant):
            raise ForbiddenAddressError(_told(text))


def check_local(host: str) -> str:
    """Return the address of this machine to listen on. Raises AddressError unless it is a number.

    `0.0.0.0` and `::` listen on all of them.
    """
    try:
        address = ip_address(check_host(host))
    except ValueError as error:
        raise AddressError(
            "give an IP address of this machine, or 0.0.0.0 to listen on all of them"
        ) from error
    if address.is_multicast or address.is_link_local or address == IPv4Address("255.255.255.255"):
        raise AddressError("is no address of one machine; 0.0.0.0 listens on all of its own")
    return str(address)


def check_network(network: str) -> str:
    """Return a network in its usual spelling. Raises AddressError."""
    try:
        return str(ip_network(network.strip()))
    except ValueError as error:
        raise AddressError(
            f"{network.strip()!r} is no network; write 192.0.2.7 or 192.0.2.0/24"
        ) from error


def _meant(address: IpAddress) -> IpAddress:
    """Return the IPv4 address that an IPv6 address stands for, else the address itself."""
    if isinstance(address, IPv4Address):
        return address
    inner = address.ipv4_mapped or address.sixtofour
    if inner is None and address.teredo:
        inner = address.teredo[1]
    if inner is None and (address in _NAT64 or int(address) < 2**32):
        inner = IPv4Address(int(address) & 0xFFFF_FFFF)
    return inner or address


def _is_outside(address: IpAddress) -> bool:
    if address.is_multicast or any(address in network for network in _NEVER_MEANT):
        return False
    if isinstance(address, IPv6Address) and _meant(address) != address:
        return True  # judged by the address it stands for
    return address.is_global


def _told(address: str) -> str:
    return (
        f"leads to {address}, which lies inside this installation's network; an administrator can "
        "allow that network with QUAYMARK_FEED_ALLOWED_NETWORKS"
    )
