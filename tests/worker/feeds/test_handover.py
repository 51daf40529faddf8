"""A feed changes hands: by a stopped worker, a killed one, or one that only seemed dead."""

import pytest
import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.config import Settings
from app.db import Database
from app.feeds import service
from app.feeds.schemas import FeedPatch
from app.tables.feeds import FeedCondition
from app.tables.operation import Lease
from tests.factories.nmea_text import VOYAGE, encoded, tag_block
from tests.feeder import Feeder, position_lines
from tests.worker.conftest import StartWorker
from tests.worker.feeds.conftest import IMPATIENT, Feeds
from tests.worker.feeds.test_tcp_feeds import assert_sums_hold
from tests.worker_process import wait_until
from worker.feeds.recorder import FeedRecorder
from worker.leases import Held, LeaseLostError, Leases


def test_a_stopped_workers_feed_goes_on_elsewhere(feeds: Feeds, feeder: Feeder) -> None:
    """What the first received is stored before it goes; the second goes on with the same sums."""
    feed_id = feeds.add(feeder.port)
    first = feeds.receive("first", feed_commit_s=60)
    feeder.wait_for_client()
    feeder.send(*position_lines(5), encoded(VOYAGE)[0].encode() + b"\n")
    feeds.receive("second")
    first.stop(5)
    assert feeds.count(feed_id, "lines", "total") == 6, "stored before it went"
    assert feeds.count(feed_id, "sentences", "orphaned") == 1
    feeder.wait_for_client(2)
    feeder.send(*position_lines(3, first=5))
    wait_until(feeds.has(feed_id, 9, "lines", "total"), what="the lines of both workers")
    status = feeds.status(feed_id)
    assert status is not None
    assert_sums_hold(status.accounting)
    assert status.accounting["sentences"]["orphaned"] == 1
    assert status.connections == 2
    assert len(feeds.positions(feed_id)) == 8


def test_a_killed_workers_feed_goes_on_without_repeats(
    feeds: Feeds, feeder: Feeder, start_worker: StartWorker
) -> None:
    """After kill -9 another worker goes on; what the receiver sends again is stored once."""
    feed_id = feeds.add(feeder.port)
    environment = {
        f"QUAYMARK_{name.upper()}": str(value).replace("'", '"')
        for name, value in IMPATIENT.items()
    }
    worker = start_worker(**environment)
    feeder.wait_for_client()
    # With the receiver's own time, or a slow test would tell of two fixes.
    tag, later = tag_block("c:1767225600"), tag_block("c:1767225660")
    voyage = [f"{tag}{line}\n".encode() for line in encoded(VOYAGE)]
    sent = [*position_lines(20, tag=tag), *voyage]
    feeder.send(*sent, f"{later}{encoded(VOYAGE, shipname='HALF')[0]}\n".encode())
    wait_until(feeds.has(feed_id, 23, "lines", "total"), what="the first lines")
    worker.kill()
    feeds.receive("other")
    feeder.wait_for_client(2)
    feeder.send(*sent, *position_lines(5, first=20, tag=tag))
    wait_until(feeds.has(feed_id, 50, "lines", "total"), what="the lines after the kill")
    status = feeds.status(feed_id)
    assert status is not None
    assert_sums_hold(status.accounting)
    assert status.accounting["messages"]["duplicates"] == 21
    assert status.accounting["sentences"]["pending"] == 0
    assert status.accounting["sentences"]["orphaned"] == 1
    assert len({row.mmsi for row in feeds.positions(feed_id)}) == len(feeds.positions(feed_id))
    assert len(feeds.statics(feed_id)) == 1


def test_who_lost_the_lease_stores_nothing(
    database: Database, settings: Settings, feeds: Feeds, feeder: Feeder
) -> None:
    """A worker that was taken for dead and wakes up finds its writes refused."""
    feed_id = feeds.add(feeder.port, enabled=False)
    own = Leases(database, settings.model_copy(update={"takeover_after_s": 1e-6}), "sleeper")
    lease = own.take("feed:1")
    assert isinstance(lease, Held)
    recorder = FeedRecorder(database, feed_id, feeds.site_id, lease)
    impatient = settings.model_copy(update={"takeover_after_s": 1e-6})
    taken = Leases(database, impatient, "other").take("feed:1")
    assert taken == Held("feed:1", lease.epoch + 1)
    assert Leases(database, settings, "third").take("feed:1") is None

    recorder.add([(recorder.found.condition_since, line) for line in position_lines(3)], 0)
    with pytest.raises(LeaseLostError):
        recorder.commit(recorder.found)
    assert feeds.positions(feed_id) == []
    assert feeds.count(feed_id, "lines", "total") == 0
    assert own.renew([lease]) == {lease}
    own.release(lease)
    assert Leases(database, settings, "third").take("feed:1") is None, "not its own to give back"


def test_an_answer_that_was_lost_is_no_second_commit(
    database: Database, settings: Settings, feeds: Feeds, feeder: Feeder
) -> None:
    """A batch that was stored although its commit seemed to fail is not counted as repeats."""
    feed_id = feeds.add(feeder.port, enabled=False)
    lease = Leases(database, settings, "worker").take("feed:1")
    assert lease is not None
    recorder = FeedRecorder(database, feed_id, feeds.site_id, lease)
    moment = recorder.found.condition_since
    lines = [(moment, line) for line in position_lines(4)]
    recorder.add(lines[:3], 0)

    @sa.event.listens_for(Session, "after_commit", once=True)
    def _lose_the_answer(_session: Session) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        recorder.commit(recorder.found)
    assert len(feeds.positions(feed_id)) == 3
    recorder.commit(recorder.found)
    recorder.add(lines[3:], 0)
    recorder.commit(recorder.found)
    assert feeds.count(feed_id, "messages", "positions") == len(feeds.positions(feed_id)) == 4
    assert feeds.count(feed_id, "messages", "duplicates") == 0


def test_an_edit_moves_the_feed_and_stopping_ends_it(
    database: Database, feeds: Feeds, feeder: Feeder
) -> None:
    """A changed address is connected to at once; a feed that is switched off hangs up."""
    feed_id = feeds.add(feeder.port)
    feeds.receive()
    feeder.wait_for_client()
    with Feeder() as other:
        edit(database, feed_id, FeedPatch(port=other.port))
        other.wait_for_client()
        other.send(*position_lines(1))
        wait_until(feeds.has(feed_id, 1, "lines", "total"), what="the line of the new address")
        edit(database, feed_id, FeedPatch(enabled=False))
        wait_until(feeds.is_at(feed_id, FeedCondition.WAITING), what="the end of the link")
    with database.reading() as session:
        lease = session.get(Lease, f"feed:{feed_id}")
        assert lease is not None
        assert lease.epoch == 2


def edit(database: Database, feed_id: int, data: FeedPatch) -> None:
    """Change a feed as REST and the page do."""
    with database.writing() as session:
        service.update_feed(session, service.get_feed(session, feed_id), data)
