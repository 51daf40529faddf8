"""REST of the caller: who am I, and my API tokens."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.auth import service
from app.auth.access import Access, allowed
from app.auth.schemas import MeOut, NewTokenOut, TokenIn, TokenOut
from app.dependencies import Page, PagingDep, SessionDep

# The plain route class: the answer with a token's text must not be stored for a repetition.
router = APIRouter(tags=["tokens"])
SignedIn = Annotated[Access, allowed(None)]


@router.get("/me")
def get_me(access: SignedIn) -> MeOut:
    """Say who is calling and what they may do."""
    return MeOut.of(access)


@router.get("/tokens")
def list_tokens(
    session: SessionDep,
    access: SignedIn,
    paging: PagingDep,
    *,
    everybody: Annotated[
        bool, Query(description="All people's tokens, for administrators")
    ] = False,
) -> Page[TokenOut]:
    """List one's own tokens, oldest first."""
    tokens, next_cursor = service.list_tokens(session, access, paging, everybody=everybody)
    return Page(items=[TokenOut.of(token) for token in tokens], next_cursor=next_cursor)


@router.post("/tokens", status_code=201)
def create_token(
    data: TokenIn, session: SessionDep, access: SignedIn, response: Response
) -> NewTokenOut:
    """Make a token within the caller's own scopes and life; its text is shown this once.

    An `Idempotency-Key` is not heeded here: repeating the answer would mean keeping the secret.
    """
    token, text = service.create_token(
        session, access, name=data.name, scopes=data.scopes, days=data.expires_days
    )
    response.headers["Location"] = f"/api/v1/tokens/{token.id}"
    return NewTokenOut(token=text, **TokenOut.of(token).model_dump())


@router.delete("/tokens/{token_id}", status_code=204)
def revoke_token(token_id: int, session: SessionDep, access: SignedIn) -> None:
    """Revoke a token at once, and the tokens that it made."""
    service.revoke_token(session, access, token_id)
