"""Feeds over UDP: datagrams with a line or a few, from senders that are allowed."""

import socket

from app.tables.feeds import FeedCondition, FeedKind
from tests.feeder import free_udp_port, position_lines
from tests.worker.feeds.conftest import Feeds
from tests.worker_process import wait_until


def test_datagrams_are_taken_from_allowed_senders(feeds: Feeds) -> None:
    """Lines of an allowed sender are stored; another's datagrams are counted and nothing else."""
    open_port, closed_port = free_udp_port(), free_udp_port()
    open_id = feeds.add(open_port, FeedKind.UDP, allowed_senders=["127.0.0.0/8"])
    closed_id = feeds.add(closed_port, FeedKind.UDP, allowed_senders=["192.0.2.0/24"])
    feeds.receive()
    for feed_id in (open_id, closed_id):
        wait_until(feeds.is_at(feed_id, FeedCondition.CONNECTED), what="the listener")
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        one, two, three = position_lines(3)
        sender.sendto(one + two, ("127.0.0.1", open_port))
        sender.sendto(three.rstrip(), ("127.0.0.1", open_port))
        sender.sendto(one, ("127.0.0.1", closed_port))
    wait_until(feeds.has(open_id, 3, "messages", "positions"), what="the datagrams")
    wait_until(
        lambda: (status := feeds.status(closed_id)) is not None and status.foreign_datagrams == 1,
        what="the foreign datagram",
    )
    assert feeds.positions(closed_id) == []
