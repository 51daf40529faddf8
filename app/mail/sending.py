"""Giving one message to the mail server, and telling failures that pass from those that stay."""

import smtplib
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from email.headerregistry import Address
from email.message import EmailMessage
from email.utils import formatdate, make_msgid, parseaddr

from app.mail.settings import MailSettings


@dataclass(frozen=True, slots=True)
class Letter:
    """A message: to whom, about what, in plain words."""

    to: str
    subject: str
    text: str


class MailError(Exception):
    """The server did not take a message; `passes` says whether trying later may help."""

    def __init__(self, reason: str, *, passes: bool) -> None:
        super().__init__(reason)
        self.passes = passes


def send(settings: MailSettings, letter: Letter) -> None:
    """Give a message to the server. Raises MailError."""
    where = f"the mail server {settings.smtp_host}:{settings.smtp_port}"
    message = _message(settings, letter)
    try:
        with _server(settings) as server:
            server.send_message(message, to_addrs=[letter.to])
    except smtplib.SMTPRecipientsRefused as error:
        code, refusal = next(iter(error.recipients.values()))
        raise MailError(
            f"{where} refuses the address: {_words(code, refusal)}", passes=code < 500
        ) from error
    except smtplib.SMTPResponseException as error:
        said = _words(error.smtp_code, error.smtp_error)
        raise MailError(f"{where} answers {said}", passes=error.smtp_code < 500) from error
    except smtplib.SMTPNotSupportedError as error:
        raise MailError(f"{where} cannot do what is needed: {error}", passes=False) from error
    except (OSError, smtplib.SMTPException) as error:
        told = str(error) or type(error).__name__
        raise MailError(f"{where} cannot be reached: {told}", passes=True) from error


@contextmanager
def _server(settings: MailSettings) -> Iterator[smtplib.SMTP]:
    place, within_s = (settings.smtp_host, settings.smtp_port), settings.smtp_timeout_s
    context = ssl.create_default_context()
    server = (
        smtplib.SMTP_SSL(*place, timeout=within_s, context=context)
        if settings.smtp_security == "tls"
        else smtplib.SMTP(*place, timeout=within_s)
    )
    with server:
        if settings.smtp_security == "starttls":
            server.starttls(context=context)
        if settings.smtp_user:
            server.login(settings.smtp_user, settings.mail_password())
        yield server


def _message(settings: MailSettings, letter: Letter) -> EmailMessage:
    message = EmailMessage()
    message["From"] = settings.smtp_sender
    try:
        message["To"] = Address(addr_spec=letter.to)
    except ValueError as error:
        raise MailError(f"{letter.to} is no address that mail goes to", passes=False) from error
    message["Subject"] = letter.subject
    message["Date"] = formatdate(localtime=False)
    message["Message-ID"] = make_msgid(domain=parseaddr(settings.smtp_sender)[1].partition("@")[2])
    message["Auto-Submitted"] = "auto-generated"  # no machine need answer
    message.set_content(letter.text)
    return message


def _words(code: int, said: bytes | str) -> str:
    text = said.decode(errors="replace") if isinstance(said, bytes) else said
    return f"{code} {' '.join(text.split())}"
