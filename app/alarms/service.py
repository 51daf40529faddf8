"""Alarms by mail: a silent feed, a disk that is nearly full.

Pages show both to whoever looks; a letter reaches those who do not. An alarm begins when something
is found wrong and ends when it has been well for a while, so that a feed which comes and goes makes
one alarm and not fifty. Each of both moments is one letter to each administrator.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from app.alarms import repository
from app.alarms.letters import ALARM_MAIL
from app.auth.administrators import administrators_of
from app.config import Settings
from app.db import now
from app.disk_room import scarce
from app.feeds import service as feeds
from app.jobs import JobClient, JobQueue
from app.storage import Storage
from app.tables.alarms import Alarm, AlarmKind, AlarmLetter
from app.tables.identity import AuditEntry

LASTS = timedelta(minutes=10)
MIB = 1 << 20
Key = tuple[AlarmKind, str]


@dataclass(frozen=True, slots=True)
class Wrong:
    """Something that is wrong now: in words, on whose site, and the page that shows it."""

    title: str
    site_id: int | None
    path: str


def what_is_wrong(session: Session, settings: Settings, storage: Storage) -> dict[Key, Wrong]:
    """Return what administrators should know of, by kind and subject."""
    found = {
        (AlarmKind.SILENT_FEED, str(view.feed.id)): Wrong(
            f"The live feed {view.feed.name} is silent",
            view.feed.site_id,
            f"/ais/feeds/{view.feed.id}",
        )
        for view in feeds.alarms(session, None)
    }
    for room in scarce(settings, storage):
        found[AlarmKind.SCARCE_DISK, room.folder] = Wrong(
            f"Only {room.free_bytes // MIB:,} MiB are left on the disk of {room.folder}", None, "/"
        )
    return found


def look(
    session: Session, jobs: JobClient, found: Mapping[Key, Wrong], moment: datetime | None = None
) -> None:
    """Begin and end alarms by what is wrong now, and queue the letters that tell of it."""
    moment = moment or now()
    standing = {(alarm.kind, alarm.subject): alarm for alarm in repository.open_alarms(session)}
    for key, wrong in found.items():
        if key in standing:
            standing[key].clear_since = None
        else:
            _begin(session, jobs, key, wrong, moment)
    for key, alarm in standing.items():
        if key in found:
            continue
        alarm.clear_since = alarm.clear_since or moment
        if moment - alarm.clear_since >= LASTS:
            alarm.ended_at = moment
            _tell(session, jobs, alarm, tells_end=True)


def _begin(session: Session, jobs: JobClient, key: Key, wrong: Wrong, moment: datetime) -> None:
    kind, subject = key
    alarm = Alarm(
        kind=kind,
        subject=subject,
        site_id=wrong.site_id,
        title=wrong.title,
        path=wrong.path,
        begun_at=moment,
    )
    session.add(alarm)
    session.flush()
    _tell(session, jobs, alarm, tells_end=False)


def _tell(session: Session, jobs: JobClient, alarm: Alarm, *, tells_end: bool) -> None:
    session.add(
        AuditEntry(
            action="end" if tells_end else "begin",
            entity="alarm",
            entity_id=alarm.id,
            site_id=alarm.site_id,
            details={"title": alarm.title},
        )
    )
    for reader in administrators_of(session, alarm.site_id):
        letter = AlarmLetter(alarm_id=alarm.id, user_id=reader.id, tells_end=tells_end)
        session.add(letter)
        session.flush()
        job_id = f"mail-alarm-{letter.id}"
        jobs.enqueue(session, ALARM_MAIL, letter.id, queue=JobQueue.MAIL, job_id=job_id)
