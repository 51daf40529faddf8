"""Alarms by mail: to whom, how often, and what they say."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from app import disk_room
from app.alarms.letters import alarm_letter
from app.alarms.service import LASTS, look, what_is_wrong
from app.config import Settings
from app.db import Database
from app.jobs import JobClient
from app.mail.sending import Letter
from app.storage import Storage
from app.tables.alarms import Alarm, AlarmLetter
from app.tables.feeds import AisFeed, FeedKind
from app.tables.identity import Role
from tests.factories import identity
from tests.factories.sites import make_site

BEGIN = datetime(2026, 11, 22, 12, tzinfo=UTC)


def test_an_alarm_is_told_once_and_once_more_when_it_is_over(
    database: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A feed's alarm goes to the site's administrators, a disk's to those of all sites.

    However often it is looked, and however a feed comes and goes: one letter at the beginning, one
    when it has been well for a while, to each.
    """
    with database.writing() as session:
        site, other = make_site(session), make_site(session)
        here = identity.make_user(session, Role.ADMIN, site.id, email="here@harbour.example")
        identity.make_user(session, Role.ADMIN, other.id, email="elsewhere@harbour.example")
        identity.make_user(session, Role.OPERATOR, email="operator@harbour.example")
        of_all = identity.make_user(session, Role.ADMIN, email="all@harbour.example")
        feed = AisFeed(
            site_id=site.id,
            name="Pier <7>",
            kind=FeedKind.UDP,
            host="127.0.0.1",
            port=10110,
            silent_after_s=60.0,
            started_at=BEGIN - timedelta(hours=1),
        )
        session.add(feed)
    jobs, storage = JobClient(settings.database_url), Storage(settings.storage_url)
    told = 0

    def letters_at(minute: float) -> list[tuple[str, str]]:
        """Look at a minute; return to whom the new letters go, and about what."""
        nonlocal told
        with database.writing() as session:
            found = what_is_wrong(session, settings, storage)
            look(session, jobs, found, BEGIN + timedelta(minutes=minute))
            rows = session.scalars(sa.select(AlarmLetter.id).where(AlarmLetter.id > told)).all()
            told = max([told, *rows])
            written = [alarm_letter(session, "https://quay.example", row) for row in rows]
        return [(letter.to, letter.subject) for letter in written if letter is not None]

    silent = "Quaymark: The live feed Pier <7> is silent"
    assert letters_at(0) == [(here.email, silent), (of_all.email, silent)]
    assert letters_at(1) == []
    with database.writing() as session:
        session.get_one(AisFeed, feed.id).enabled = False
    assert letters_at(2) == []
    with database.writing() as session:
        session.get_one(AisFeed, feed.id).enabled = True
    assert letters_at(20) == []
    monkeypatch.setattr(disk_room, "SCARCE_BYTES", 1 << 62)
    monkeypatch.setattr(disk_room, "SCARCE_SHARE", 1.0)
    ((to, subject),) = letters_at(21)
    assert (to, subject.startswith("Quaymark: Only ")) == (of_all.email, True)
    monkeypatch.undo()
    with database.writing() as session:
        session.get_one(AisFeed, feed.id).enabled = False
    assert letters_at(22) == []
    over = letters_at(22 + LASTS.total_seconds() / 60)
    assert sorted(to for to, _ in over) == [of_all.email, of_all.email, here.email]
    assert all(subject.startswith("Quaymark: over: ") for _, subject in over)
    with database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).where(Alarm.ended_at.is_(None))) == 0
        first = session.scalars(sa.select(AlarmLetter.id).order_by(AlarmLetter.id)).first()
        letter = alarm_letter(session, "https://quay.example", first or 0)
    assert letter == Letter(
        here.email,
        silent,
        "The live feed Pier <7> is silent, noticed at 2026-11-22 12:00 UTC.\n\n"
        f"Look at https://quay.example/ais/feeds/{feed.id}\n\n"
        "This is told once. When it is over, you get one more mail.\n",
    )
    jobs.destroy()
