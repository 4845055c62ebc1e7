"""The page over many takes: the worst first, what recurs named once, and a line for every take."""

import re
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

import pytest

from psvideo.errors import PsvideoError
from psvideo.report.judgement import Judgement, verdict_of
from psvideo.report.takes_report import TakeResult, takes_page, worst_first
from psvideo.runs.many_takes.handed_out import do_piece, result_of_future
from psvideo.runs.many_takes.normals_of_takes import _counts
from psvideo.runs.many_takes.several_takes import result_of, several_takes, whole_options
from psvideo.runs.normals import normals
from psvideo.runs.steps.checked import Check, check_page

GOOD = Judgement(subject="timing", grade="good", found="Flash times are known to 0.01 row.")


def line(subject: str, grade: Any) -> Judgement:
    return Judgement(subject=subject, grade=grade, found=f"The {subject} is {grade}.", advice="Change it.")


def check(name: str, *judgements: Judgement) -> Check:
    return Check(
        clip=name, path=Path(name), frames=10, looked_at=5, judged=(1, 5), seconds=1.0, judgements=(GOOD, *judgements)
    )


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


class Recorded:
    """What a cluster's client is handed, done here at once."""

    def __init__(self) -> None:
        self.calls = 0

    def submit(self, call: Any, *values: Any, **given: Any) -> Any:
        self.calls += 1
        return call(*values, **{name: value for name, value in given.items() if name == "after"})


class Damaged:
    """A take whose footage is at fault."""

    pieces = 3

    def __init__(self) -> None:
        self.tried: list[int] = []

    def do(self, number: int) -> None:
        self.tried.append(number)
        raise PsvideoError("frame.7.exr: is damaged.")


def test_footage_at_fault_is_told_and_neither_tried_again_nor_by_the_pieces_that_wait() -> None:
    take, client = Damaged(), Recorded()
    first = client.submit(do_piece, take, 0, after="", retries=2)
    assert first == "frame.7.exr: is damaged."
    assert [client.submit(do_piece, take, number, after=first, retries=2) for number in (1, 2)] == [first, first]
    assert take.tried == [0]


def test_what_is_no_fault_of_the_footage_is_raised_for_another_try() -> None:
    class Unlucky(Damaged):
        def do(self, number: int) -> None:
            raise OSError("the disk is gone")

    with pytest.raises(OSError, match="gone"):
        do_piece(Unlucky(), 0, after="")


def test_workers_elsewhere_get_whole_paths_as_text_and_as_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"rig": "rig.toml", "mask": Path("mask.png"), "depth": None, "frames": "1-9", "solver": "robust"}
    assert whole_options(normals, options) == {
        "rig": tmp_path / "rig.toml",
        "mask": tmp_path / "mask.png",
        "depth": None,
        "frames": "1-9",
        "solver": "robust",
    }


def test_a_take_that_cannot_be_opened_is_one_piece_and_does_not_keep_the_others(tmp_path: Path) -> None:
    takes = several_takes([tmp_path / "gone", tmp_path / "lost"], out=tmp_path / "out", force=False, resume=False)
    assert list(_counts(takes, 2, {})) == [1, 1]


def test_a_report_that_cannot_be_read_is_that_take_s_fault(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text("{", encoding="utf-8")
    assert f"{tmp_path / 'report.json'}: cannot be read" in result_of(tmp_path, tmp_path).fault
    assert "cannot be read" in result_of(tmp_path, tmp_path / "gone").fault


class Finished:
    """A future that is done, whose answer does not come: the scheduler died meanwhile."""

    status, key = "finished", "one"

    def __init__(self, fault: BaseException) -> None:
        self.fault = fault

    def result(self) -> str:
        raise self.fault


@pytest.mark.parametrize("fault", [OSError("Stream is closed"), CancelledError("client-request")])
def test_an_answer_that_does_not_come_is_a_scheduler_that_is_gone(fault: BaseException) -> None:
    with pytest.raises(PsvideoError, match=r"The cluster's scheduler is gone\. Run the command again"):
        result_of_future(Finished(fault))
