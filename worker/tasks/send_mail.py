"""The jobs that send mail: tried again after longer and longer pauses while the server fails.

They wait in a queue of their own: a mail server that is away keeps no other work waiting.
"""

from collections.abc import Callable

import structlog
from sqlalchemy.orm import Session

from app.alarms.letters import ALARM_MAIL, alarm_letter
from app.auth import letters as written
from app.config import Settings
from app.db import Database
from app.errors import AppError
from app.jobs import JobRunner
from app.mail.sending import Letter, MailError, send

WriteLetter = Callable[[Session, str, int], Letter | None]
log = structlog.get_logger()


class SendMail:
    """Does the jobs of one kind of letter."""

    def __init__(
        self,
        runner: JobRunner,
        database: Database,
        settings: Settings,
        job: str,
        write: WriteLetter,
    ) -> None:
        self.job = job
        self._write = write
        self._runner = runner
        self._database = database
        self._settings = settings

    def do(self, identifier: int) -> None:
        """Write the letter and send it. Raises AppError when the server took it at no try."""
        for pause_s in (*self._settings.smtp_pauses_s, None):
            reason = self._runner.step("send", self._send, identifier)
            if not reason:
                return
            log.warning("mail not sent", job=self.job, reason=reason, pause_s=pause_s)
            if pause_s is not None:
                self._runner.sleep(pause_s)
        raise AppError(reason)

    def fail(self, reason: str, identifier: int) -> None:
        """Leave it at the job's own reason: no row waits for a letter."""

    def give_up(self, session: Session, job_id: str, reason: str) -> None:
        """Leave it at the job's own reason."""

    def _send(self, identifier: int) -> str:
        """Send, and return why that failed for now; empty when it went well."""
        if not self._settings.sends_mail:
            raise AppError("no mail server is configured; set QUAYMARK_SMTP_HOST for the worker")
        address = self._settings.public_url.rstrip("/")
        with self._database.writing() as session:  # stored before it can be read in the letter
            letter = self._write(session, address, identifier)
        if letter is None:
            return ""
        try:
            send(self._settings, letter)
        except MailError as error:
            if not error.passes:
                raise AppError(str(error)) from error
            return str(error)
        return ""


def letters(runner: JobRunner, database: Database, settings: Settings) -> tuple[SendMail, ...]:
    """Return what does the jobs of all kinds of letters."""
    kinds: dict[str, WriteLetter] = {
        written.INVITATION_MAIL: written.invitation_letter,
        written.RESET_MAIL: written.reset_letter,
        ALARM_MAIL: alarm_letter,
    }
    return tuple(SendMail(runner, database, settings, job, write) for job, write in kinds.items())
