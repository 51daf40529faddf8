"""What is done ahead is what is done in its turn."""

from worker.tasks.work_ahead import WorkAhead


def test_stretches_are_done_once_and_again_only_after_a_failure() -> None:
    """A stretch begun early is not done twice, one that failed is, and none is beyond the end."""
    asked: list[int] = []

    def do(start: int, stop: int) -> range:
        asked.append(start)
        if asked == [0, 2]:
            raise ConnectionError("the database was away")
        return range(start, stop)

    ahead = WorkAhead(do, end=6)
    assert ahead.take(0, 2) == range(2)
    for start in (2, 4, 6):
        ahead.begin(start, start + 2)
    assert ahead.take(2, 4) == range(2, 4)
    assert ahead.take(4, 6) == range(4, 6)
    ahead.give_up()
    assert sorted(asked) == [0, 2, 2, 4]
