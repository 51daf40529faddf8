"""What alarms say by mail: that something is wrong, and that it is over."""

from sqlalchemy.orm import Session

from app.alarms import repository
from app.auth.administrators import administrators_of
from app.mail.sending import Letter

ALARM_MAIL = "mail alarm"


def alarm_letter(session: Session, address: str, letter_id: int) -> Letter | None:
    """Write a letter; None when its reader administers nothing here any more."""
    row = repository.letter(session, letter_id)
    if row is None:
        return None
    alarm = row.alarm
    readers = {user.id: user for user in administrators_of(session, alarm.site_id)}
    reader = readers.get(row.user_id)
    if reader is None:
        return None
    look = f"{address}{alarm.path}"
    begun = f"{alarm.begun_at:%Y-%m-%d %H:%M} UTC"
    if not row.tells_end:
        return Letter(
            reader.email,
            f"Quaymark: {alarm.title}",
            f"{alarm.title}, noticed at {begun}.\n\nLook at {look}\n\n"
            "This is told once. When it is over, you get one more mail.\n",
        )
    ended = f"{alarm.clear_since or alarm.ended_at:%Y-%m-%d %H:%M} UTC"
    return Letter(
        reader.email,
        f"Quaymark: over: {alarm.title}",
        f"It is over since {ended}: {alarm.title} (noticed at {begun}).\n\nLook at {look}\n",
    )
