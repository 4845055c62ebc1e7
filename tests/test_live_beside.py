"""What is done beside a live run: never in the way of results, always of the newest, and its faults are heard."""

import threading
import time
from typing import cast

import pytest

from psvideo.live.beside import beside
from psvideo.live.chain import NewestRound

MOST_S = 10.0


def _numbered(number: int) -> NewestRound:
    return cast(NewestRound, number)


def test_a_result_never_waits_and_the_newest_is_looked_at_next() -> None:
    seen: list[int] = []
    began, go, second = threading.Event(), threading.Event(), threading.Event()

    def slow(newest: NewestRound) -> None:
        seen.append(cast(int, newest))
        if len(seen) == 2:
            second.set()
        began.set()
        assert go.wait(MOST_S)

    with beside(slow) as take:
        take(_numbered(0))
        assert began.wait(MOST_S)
        for number in range(1, 6):
            take(_numbered(number))  # returns, though the first one is not done
        assert seen == [0]
        go.set()
        assert second.wait(MOST_S)
    assert seen == [0, 5]


def test_what_goes_wrong_is_raised_where_results_are_made() -> None:
    threads = threading.active_count()

    def wrong(newest: NewestRound) -> None:
        raise ValueError("no such light")

    with beside(wrong) as take:
        take(_numbered(0))
        until_s = time.monotonic() + MOST_S
        while threading.active_count() > threads and time.monotonic() < until_s:
            time.sleep(0.005)
        with pytest.raises(ValueError, match="no such light"):
            take(_numbered(1))


def test_the_thread_is_gone_when_the_run_is_over() -> None:
    before = threading.active_count()
    with beside(lambda newest: None) as take:
        take(_numbered(0))
        assert threading.active_count() == before + 1
    assert threading.active_count() == before
