"""The page over many takes: the worst first, what recurs named once, and a line for every take."""

import re
from pathlib import Path
from typing import Any

from psvideo.report.judgement import Judgement, verdict_of
from psvideo.report.of_takes import TakeResult, takes_page, worst_first
from psvideo.runs.steps.checked import Check, check_page

GOOD = Judgement(subject="timing", grade="good", found="Flash times are known to 0.01 row.")


def line(subject: str, grade: Any) -> Judgement:
    return Judgement(subject=subject, grade=grade, found=f"The {subject} is {grade}.", advice="Change it.")


def check(name: str, *judgements: Judgement) -> Check:
    return Check(clip=name, path=Path(name), frames=10, looked_at=5, seconds=1.0, judgements=(GOOD, *judgements))


def result(name: str, *judgements: Judgement) -> TakeResult:
    record = {
        "verdict": verdict_of(judgements),
        "usable": all(one.grade != "bad" for one in judgements),
        "findings": [one.sentence for one in judgements],
        "judgements": [{"subject": one.subject, "grade": one.grade} for one in judgements],
        "instants": [{"valid_share": 0.9}],
    }
    return TakeResult.of(Path(name), Path(name), record)


def order(page: str) -> list[str]:
    """The takes' names as the table has them."""
    return re.findall(r"<th><a href=\"[^\"]*\">(\w+)</a></th>", page)


def test_a_take_that_is_doubtful_as_a_whole_comes_before_one_with_many_reservations() -> None:
    results = [
        result("fine"),
        result("reserved", line("exposure", "doubtful"), line("ambient", "doubtful"), line("motion", "doubtful")),
        result("unsure", line("timing", "doubtful")),
        result("clipped", line("exposure", "bad")),
        TakeResult(clip=Path("broken"), out=Path("broken"), fault="Frame 3 is damaged."),
    ]
    page = takes_page(worst_first(results))
    assert order(page) == ["broken", "clipped", "unsure", "reserved", "fine"]
    assert "3 usable (2 of them with reservations or doubts), 1 not, 1 failed" in page
    recurring = page[page.index("In more than one take") : page.index("All takes")]
    assert "bad in 1 take and doubtful in 1 take" in recurring
    assert "motion" not in recurring, "it is in one take only"


def test_every_link_to_a_place_on_the_page_leads_somewhere() -> None:
    page = takes_page([result(f"take{n}", *([line("rig", "bad")] if n % 2 else [])) for n in range(30)])
    places = set(re.findall(r'id="(\w+)"', page))
    assert set(re.findall(r'href="#(\w+)"', page)) == places
    assert len(places) == 15
    assert "and 9 more" in page
    assert page.count('href="take0/report.html"') == 1, "what needs no words leads to its report at once"


def test_checks_of_named_takes_come_the_worst_first_and_of_a_watched_folder_the_newest() -> None:
    checks = [check("fine"), check("clipped", line("exposure", "bad")), check("unsure", line("rig", "doubtful"))]
    assert order(check_page(checks, {}, worst_first=True)) == ["clipped", "unsure", "fine"]
    assert order(check_page(checks, {})) == ["unsure", "clipped", "fine"]
    assert order(check_page(checks, {Path("gone"): "It was removed."}))[0] == "gone"
