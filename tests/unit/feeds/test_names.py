"""Name servers may be dead, slow or bribed: a feed connects in time, and only where it may."""

import threading
from collections.abc import Sequence

import pytest

from app.addresses import AddressError, Destination, ForbiddenAddressError, UnansweredError, judge
from worker.feeds import names
from worker.feeds.names import NamedPlace

FIRST, SECOND = Destination("198.41.0.4", 4001), Destination("199.9.14.201", 4001)


class NameServer:
    """Gives one answer after another; the last one for ever. None: nothing, until `wake`."""

    def __init__(self, *answers: Sequence[Destination] | AddressError | None) -> None:
        self.answers = list(answers)
        self.wake = threading.Event()
        self.asked = 0

    def __call__(self, _host: str, _port: int, allowed: Sequence[str]) -> Sequence[Destination]:
        """Answer like `resolve_all`."""
        self.asked += 1
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if answer is None:
            self.wake.wait()
            answer = [SECOND]
        if isinstance(answer, AddressError):
            raise answer
        judge([place.ip for place in answer], allowed)
        return answer


@pytest.fixture(autouse=True)
def _hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(names, "KNOWN_WAIT_S", 0.01)


def place(server: NameServer) -> NamedPlace:
    """Return where a feed's name leads, waited for only for a moment."""
    return NamedPlace("ais.example", 4001, [], 0.05, server)


def test_a_dead_name_server_holds_no_feed_that_served_before() -> None:
    """The address known goes on being used; one look-up runs, and its late answer counts."""
    server = NameServer([FIRST], None)
    at = place(server)
    assert [at.destination() for _ in range(4)] == [FIRST] * 4
    assert server.asked == 2
    server.wake.set()
    while at.destination() != SECOND:
        pass


@pytest.mark.parametrize("answer", [None, UnansweredError("no name server answers")])
def test_a_name_never_known_is_told(answer: AddressError | None) -> None:
    """Without an address known the feed says that nobody answers, and tries again."""
    server = NameServer(answer)
    with pytest.raises(UnansweredError, match="name server"):
        place(server).destination()
    server.wake.set()


def test_a_name_that_leads_inside_is_refused_although_it_served_before() -> None:
    """Rebinding gains nothing: neither the address inside is used nor the one before."""
    at = place(NameServer([FIRST], [Destination("127.0.0.1", 4001)], UnansweredError("gone")))
    assert at.destination() == FIRST
    with pytest.raises(ForbiddenAddressError):
        at.destination()
    with pytest.raises(UnansweredError):
        at.destination()


def test_each_attempt_takes_the_next_address() -> None:
    """Where the first of a name's addresses does not answer, the others get their turn."""
    at = place(NameServer([FIRST, SECOND]))
    assert [at.destination(attempt) for attempt in range(3)] == [FIRST, SECOND, FIRST]
