"""One letter given to a real mail server: encrypted, with a login, and refused."""

import datetime as dt
import ssl
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from pydantic import ValidationError

from app.config import Settings
from app.mail.sending import Letter, MailError, send
from tests.mail_server import MailServer, text_of

LETTER = Letter("ada@harbour.example", "Grüße", "A long way: äöü\n")


def installation(server: MailServer, tmp_path: Path, **chosen: Any) -> Settings:
    """Return settings that send by a server."""
    return Settings(
        data_dir=tmp_path,
        public_url="https://quay.example",
        smtp_host="127.0.0.1",
        smtp_port=server.port,
        smtp_sender="Quaymark <quay@harbour.example>",
        **chosen,
    )


def certificate(folder: Path) -> Path:
    """Write a certificate of this machine with its key; returns the file with both."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "127.0.0.1")])
    moment = dt.datetime.now(dt.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(moment - dt.timedelta(days=1))
        .not_valid_after(moment + dt.timedelta(days=1))
        .add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))]), critical=False
        )
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    path = folder / "server.pem"
    path.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
        + made.public_bytes(serialization.Encoding.PEM)
    )
    return path


def test_a_letter_goes_encrypted_with_a_login(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """STARTTLS and a password from a file; a certificate that nobody vouches for is refused."""
    pem = certificate(tmp_path)
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(pem)
    password = tmp_path / "password"
    password.write_text("quiet water\n")
    with MailServer(tls=tls, login=("quay", "quiet water")) as server:
        chosen = {"smtp_user": "quay", "smtp_password_file": password}
        settings = installation(server, tmp_path, **chosen)
        with pytest.raises(MailError, match="CERTIFICATE_VERIFY_FAILED"):
            send(settings, LETTER)
        monkeypatch.setenv("SSL_CERT_FILE", str(pem))
        send(settings, LETTER)
        password.write_text("wrong")
        with pytest.raises(MailError, match="535") as refused:
            send(settings, LETTER)
    assert refused.value.passes is False
    (letter,) = server.letters
    assert (letter["To"], letter["Subject"]) == (LETTER.to, LETTER.subject)
    assert (letter["From"], letter["Auto-Submitted"]) == (
        "Quaymark <quay@harbour.example>",
        "auto-generated",
    )
    assert text_of(letter) == LETTER.text


def test_what_fails_is_told_and_whether_it_passes(tmp_path: Path) -> None:
    """451 passes, 550 stays, a closed port passes, two addresses in one are none."""
    with MailServer() as server:
        settings = installation(server, tmp_path, smtp_security="none")
        for refusal, passes in (("451 later", True), ("550 no such person", False)):
            server.refusals = [refusal]
            with pytest.raises(MailError, match=refusal) as refused:
                send(settings, LETTER)
            assert refused.value.passes is passes
        with pytest.raises(MailError, match="no address") as refused:
            send(settings, Letter("eve,ada@harbour.example", "", ""))
    assert refused.value.passes is False
    with pytest.raises(MailError, match="cannot be reached") as refused:
        send(settings, LETTER)
    assert refused.value.passes is True


def test_settings_that_are_half_a_server_are_refused(tmp_path: Path) -> None:
    """A sender and a public address are needed, and a password never goes in the clear."""
    whole: dict[str, Any] = {
        "data_dir": tmp_path,
        "smtp_host": "mail.example",
        "smtp_sender": "quay@harbour.example",
        "public_url": "https://quay.example",
    }
    assert Settings(**whole).sends_mail
    for wrong, named in (
        ({"smtp_sender": ""}, "SMTP_SENDER"),
        ({"public_url": ""}, "PUBLIC_URL"),
        ({"smtp_user": "quay", "smtp_security": "none"}, "in the clear"),
    ):
        with pytest.raises(ValidationError, match=named):
            Settings(**whole | wrong)
