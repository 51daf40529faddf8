"""What an installation says about its mail server, as QUAYMARK_SMTP_* variables."""

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, SecretStr, model_validator
from pydantic_settings import BaseSettings


class MailSettings(BaseSettings):
    """The server that takes mail; without a host none is sent."""

    public_url: str = ""

    smtp_host: str = ""
    smtp_port: int = Field(587, ge=1, le=65535)
    smtp_security: Literal["starttls", "tls", "none"] = "starttls"
    smtp_user: str = ""
    smtp_password: SecretStr = SecretStr("")
    smtp_password_file: Path | None = None
    smtp_sender: str = Field("", description="An address, or a name and one: Quay <quay@a.org>")
    smtp_timeout_s: float = Field(20.0, gt=0, le=300)
    smtp_pauses_s: list[float] = Field(
        [5.0, 60.0, 300.0], description="Before each further try, when the server fails"
    )

    @property
    def sends_mail(self) -> bool:
        """Whether there is a server to send mail by."""
        return bool(self.smtp_host)

    def mail_password(self) -> str:
        """Return the password for the server, from its file where one is named."""
        if self.smtp_password_file is not None:
            return self.smtp_password_file.read_text().strip()
        return self.smtp_password.get_secret_value()

    @model_validator(mode="after")
    def _mail_is_whole(self) -> Self:
        if not self.sends_mail:
            return self
        if "@" not in self.smtp_sender or "\n" in self.smtp_sender:
            raise ValueError("QUAYMARK_SMTP_SENDER must be the address that mail comes from")
        if not self.public_url:
            # Never the Host header: whoever asks for a link could make it lead elsewhere.
            raise ValueError("QUAYMARK_PUBLIC_URL is missing; links in mail begin with it")
        if self.smtp_user and self.smtp_security == "none":
            raise ValueError(
                "QUAYMARK_SMTP_SECURITY none would send the password in the clear; use starttls or "
                "tls, or leave QUAYMARK_SMTP_USER empty"
            )
        return self
