"""Feeds over TCP: what comes is stored and accounted for, whatever the other side does."""

from app.tables.feeds import FeedCondition
from tests.factories.nmea_text import POSITION, VOYAGE, encoded
from tests.feeder import FIRST_MMSI, Feeder, position_lines
from tests.worker.feeds.conftest import Feeds
from tests.worker_process import wait_until


def assert_sums_hold(account: dict[str, dict[str, object]]) -> None:
    """Check the three sums of the accounting."""
    lines, sentences, messages = account["lines"], account["sentences"], account["messages"]
    parts = ("sentence", "time_only", "other", "dropped")
    assert lines["total"] == sum(lines[part] for part in parts)
    rejected = sum(sentences["rejected"].values())
    parts = ("assembled", "orphaned", "pending")
    assert sentences["total"] == rejected + sum(sentences[part] for part in parts)
    rejected = sum(messages["rejected"].values())
    parts = ("positions", "statics", "duplicates", "ignored_type")
    assert messages["assembled"] == rejected + sum(messages[part] for part in parts)


def test_all_that_comes_is_accounted_for(feeds: Feeds, feeder: Feeder) -> None:
    """Good, damaged, truncated and endless lines each fall into their bucket; other feeds go on."""
    with Feeder() as bad:
        good_id, bad_id = feeds.add(feeder.port), feeds.add(bad.port)
        supervisor = feeds.receive()
        feeder.wait_for_client()
        bad.wait_for_client()
        first, second = (line.encode() for line in encoded(VOYAGE))
        lost = encoded(POSITION, lat=91.0, mmsi=FIRST_MMSI + 7)[0].encode()
        repeated = position_lines(1, first=50)[0]
        bad.send(b"\xff\x00garbage\n", b"x" * 100_000, b"\n")
        bad.send(b"!AIVDM,1,1,,A,13aG?P0P00PD;88MD5MTDww@2<0L,0*00\n", lost, b"\n", first, b"\n")
        bad.send(position_lines(1)[0].replace(b",0*", b"0,0*"), *position_lines(1, first=8))
        feeder.send(*position_lines(5), first, b"\n", second, b"\n", repeated, repeated)
        wait_until(feeds.has(good_id, 9, "lines", "total"), what="the good lines")
        wait_until(feeds.has(bad_id, 7, "lines", "total"), what="the bad lines")
        supervisor.stop(5)

    good, damaged = feeds.status(good_id), feeds.status(bad_id)
    assert good is not None
    assert damaged is not None
    assert_sums_hold(good.accounting)
    assert_sums_hold(damaged.accounting)
    assert good.accounting["messages"]["positions"] == len(feeds.positions(good_id)) == 6
    assert good.accounting["messages"]["duplicates"] == 1
    assert [static.name for static in feeds.statics(good_id)] == ["ELBE 3"]
    assert damaged.accounting["lines"]["other"] == 2
    assert damaged.accounting["sentences"]["rejected"] == {"checksum": 2}
    assert damaged.accounting["sentences"]["orphaned"] == 1
    assert damaged.accounting["messages"]["rejected"] == {"position": 1}
    assert [row.mmsi for row in feeds.positions(bad_id)] == [FIRST_MMSI + 8]


def test_a_link_that_is_cut_is_made_again(feeds: Feeds, feeder: Feeder) -> None:
    """After a cut, and after the receiver was away for a while, lines come again."""
    feed_id = feeds.add(feeder.port)
    feeds.receive()
    feeder.wait_for_client()
    feeder.send(*position_lines(2), b"!AIVDM,1,1,,A,13aG")
    wait_until(feeds.has(feed_id, 2, "lines", "total"), what="the first lines")
    feeder.go_away()
    wait_until(feeds.says(feed_id, "Nobody answers"), what="the waiting")
    feeder.come_back()
    feeder.wait_for_client(2)
    feeder.send(*position_lines(2, first=2))
    wait_until(feeds.has(feed_id, 5, "lines", "total"), what="the lines after the cut")
    status = feeds.status(feed_id)
    assert status is not None
    assert status.condition is FeedCondition.CONNECTED
    assert status.connections == 2
    assert_sums_hold(status.accounting)
    assert len(feeds.positions(feed_id)) == 4


def test_a_link_that_stalls_is_made_anew(feeds: Feeds, feeder: Feeder) -> None:
    """A connection over which nothing comes, half-open or not, is given up and made anew."""
    feed_id = feeds.add(feeder.port)
    feeds.receive(feed_stall_s=0.3)
    feeder.wait_for_client(2)
    wait_until(feeds.says(feed_id, "Nothing came"), what="the reason")


def test_a_forbidden_address_is_refused_at_each_connection(feeds: Feeds, feeder: Feeder) -> None:
    """A feed that slipped in, or whose name leads inside by now, is refused and never connected."""
    own_id = feeds.add(feeder.port)
    metadata_id = feeds.add(80, host="169.254.169.254")
    feeds.receive(feed_allowed_networks=[])
    for feed_id in (own_id, metadata_id):
        wait_until(feeds.is_at(feed_id, FeedCondition.REFUSED), what="the refusal")
    assert feeds.says(own_id, "QUAYMARK_FEED_ALLOWED_NETWORKS")()
    assert feeder.accepted == 0
