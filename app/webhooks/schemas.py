"""Shapes of webhooks in REST."""

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from app.sites.fields import Request
from app.tables.webhooks import DeliveryStatus, Webhook, WebhookDelivery, WebhookEvent
from app.webhooks.sending import check_url


def _wanted(events: list[WebhookEvent]) -> list[WebhookEvent]:
    if WebhookEvent.TEST in events:
        raise ValueError("test deliveries are asked for one by one, not subscribed to")
    return list(dict.fromkeys(events))


Url = Annotated[
    str,
    AfterValidator(check_url),
    Field(min_length=1, max_length=2000, description="Where deliveries are sent by POST"),
]
Events = Annotated[list[WebhookEvent], AfterValidator(_wanted), Field(min_length=1, max_length=10)]
ALL_EVENTS = [WebhookEvent.RUN_FINISHED, WebhookEvent.EXPORT_FINISHED]


class WebhookIn(Request):
    """A new webhook of a site."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"url": "https://example.org/quaymark", "events": ["run.finished"]}]
        }
    )

    url: Url
    events: Events = ALL_EVENTS
    enabled: bool = True


class WebhookPatch(Request):
    """What to change of a webhook; fields left out stay."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"enabled": False}]})

    url: Url | None = None
    events: Events | None = None
    enabled: bool | None = None


class WebhookOut(BaseModel):
    """A webhook, without its secret."""

    id: int
    site_id: int
    url: str
    events: list[WebhookEvent]
    enabled: bool
    old_secret_until: datetime | None = Field(description="Until then the old secret signs, too")
    created_at: datetime
    version: int

    @classmethod
    def of(cls, webhook: Webhook) -> Self:
        """Show a row."""
        return cls(**{name: getattr(webhook, name) for name in WebhookOut.model_fields})


class SecretOut(WebhookOut):
    """A webhook with the secret that signs its deliveries; shown this once."""

    secret: str = Field(examples=["whsec_bG9uZyBhbmQgcmFuZG9t"])

    @classmethod
    def of(cls, webhook: Webhook) -> Self:
        """Show a row with its secret."""
        return cls(**WebhookOut.of(webhook).model_dump(), secret=webhook.secret)


class DeliveryOut(BaseModel):
    """A delivery and how it went."""

    id: int
    webhook_id: int
    event: WebhookEvent
    content: dict[str, Any]
    status: DeliveryStatus
    attempts: int
    next_try_at: datetime | None
    answer_status: int | None
    error: str | None
    created_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, delivery: WebhookDelivery) -> Self:
        """Show a row; one that has ended has no next try."""
        shown = {name: getattr(delivery, name) for name in cls.model_fields}
        if delivery.status is not DeliveryStatus.WAITING:
            shown["next_try_at"] = None
        return cls(**shown)
