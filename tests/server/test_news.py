"""Tests the news of a helper: its first failure, its first answer after failures, and no more."""

from __future__ import annotations

from hapticvlm.server.news import HelperNews, News

NEWS_S = 60.0

FAILS = News("the model fails: HTTP 401", is_good=False)
AGAIN = News("the model answers again", is_good=True)


def heard(*answers: tuple[float, str | None]) -> list[News]:
    """The news after answers at these times (s), each with its error or None."""
    news = HelperNews()
    taken = []
    for now, error in answers:
        news.note("the model", error, now)
        taken.append(news.take())
    return [item for item in taken if item is not None]


def test_the_first_failure_is_news_and_those_that_follow_are_not() -> None:
    assert heard(*[(float(now), "HTTP 401") for now in range(300)]) == [FAILS]


def test_a_helper_that_answers_is_no_news() -> None:
    assert heard((0.0, None), (1.0, None)) == []


def test_the_first_answer_after_failures_is_good_news() -> None:
    assert heard((0.0, "HTTP 401"), (NEWS_S, None), (NEWS_S + 1.0, None)) == [FAILS, AGAIN]


def test_a_helper_that_fails_and_answers_in_turns_is_news_once_a_minute() -> None:
    turns = [(float(now), "HTTP 401" if now % 2 else None) for now in range(200)]

    assert 3 <= len(heard(*turns)) <= 4
