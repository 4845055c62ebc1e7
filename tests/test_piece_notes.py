"""What pieces leave for each other: notes that are read back as they were, folders that are one run's."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from clips_in_pieces import filmed, same_in_pieces

import psvideo as ps
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.whole_folders import begun_folder, whole_folder
from psvideo.model.surface import Metal, Reflectance, RivalLobes, Subject
from psvideo.report.observe.against_noise import AgainstNoise
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.outward import Facing
from psvideo.report.observe.rig_and_curve.rigpoints import PointLight
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean
from psvideo.report.observe.worst import Thumbnail, Worst
from psvideo.runs.instants.job import Found
from psvideo.runs.instants.piece_notes import note_subject, noted, noted_subject, write_notes
from psvideo.runs.instants.pieces import piece_named
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.replies import Identity
from psvideo.strobe.program import make_program
from psvideo.strobe.runlog import format_log, run_log
from psvideo.strobe.session import Outcome, Ready


@pytest.mark.parametrize("word", ["", "3", "6/5", "-1/5", "a/b", "1/5/2"])
def test_a_word_that_names_no_piece_is_refused(word: str) -> None:
    with pytest.raises(UsageError, match="expected which of how many"):
        piece_named(word, range(10))


def test_what_a_piece_found_is_read_back_as_it_was(tmp_path: Path) -> None:
    facts = InstantFacts(
        number=1003, time_s=0.1 + 0.2, valid_share=1 / 3, clipped_share=0.0, unseen_share=0.0, levels=(0.1, 2 / 3)
    )
    normals, valid = np.ones((2, 3, 3), np.float16), np.eye(2, 3, dtype=np.bool_)
    worst = Thumbnail(number=1003, badness=0.7, why="67 % valid", normals=normals, valid=valid)
    observed = Observed(
        lights=("a", "b"),
        facts=KeptFacts([facts]),
        counts={"a": np.arange(5), "b": np.arange(5) * 2},
        closely=CloseLooks(
            blurs_px=[0.7],
            noises=[AgainstNoise(level=1 / 3, read=1e-6, photon=2 / 3)],
            leans=[Lean(lean_deg=1 / 3, gain=0.2, turn_deg=(0.1, 0.2, 0.3), rest_deg=0.1)],
            outward=[Facing(cosine=1 / 3, apart=0.1)],
            in_shadow=[0.04],
        ),
        light_at_points=[PointLight(np.random.default_rng(1).random((4, 2)), np.array([1.0, 4.0]))],
        ambient_measured={128: 0.25},
        worst=Worst([worst]),
    )
    picture = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    write_notes(tmp_path, range(1003, 1004), Found(observed=observed, picture=picture, reserved=("No scale.",)))
    ((numbers, found),) = noted(tmp_path)
    seen = found.observed
    assert (numbers, found.reserved, list(seen.facts)) == (range(1003, 1004), ("No scale.",), [facts])
    assert (seen.closely, seen.ambient_measured) == (observed.closely, {128: 0.25})
    assert all(np.array_equal(seen.counts[light], observed.counts[light]) for light in observed.counts)
    assert np.array_equal(seen.light_at_points[0].light, observed.light_at_points[0].light)
    assert seen.light_at_points[0].white.tolist() == [1.0, 4.0]
    assert found.picture is not None
    assert np.array_equal(found.picture, picture)
    assert [(one.number, one.badness, one.why) for one in seen.thumbnails] == [(1003, 0.7, "67 % valid")]
    assert np.array_equal(seen.thumbnails[0].valid, valid)


def test_every_number_that_was_noted_of_a_round_comes_back_and_follows_those_before(tmp_path: Path) -> None:
    names = [one.name for one in fields(CloseLooks) if one.type == list[float]]
    assert {"slopes", "away", "in_shadow"} <= set(names)
    one = Observed(lights=("a",))
    for n, name in enumerate(names):
        getattr(one.closely, name).append(0.25 + n)
    write_notes(tmp_path, range(3, 5), Found(observed=one))
    ((_, found),) = noted(tmp_path)
    one.followed_by(found.observed)
    assert {name: getattr(one.closely, name) for name in names} == {
        name: [0.25 + n] * 2 for n, name in enumerate(names)
    }


METAL = Metal((0.25, *(0.0,) * 14, 1 / 3, 0.1), (RivalLobes((0.5,) * 17, 1e-4 / 3), RivalLobes((0.1 + 0.2,) * 17, 1.0)))


@pytest.mark.parametrize(
    "subject",
    [
        Subject(reflectance=None),
        Subject(reflectance=Reflectance(1 / 3, 0.0, 0.1, 0.2, 0.3, 0.7), metal=METAL),
        Subject(reflectance=None, metal=METAL),
    ],
)
def test_pieces_take_the_subject_for_what_the_first_of_them_found(tmp_path: Path, subject: Subject) -> None:
    assert noted_subject(tmp_path) is None
    note_subject(tmp_path, subject)
    note_subject(tmp_path, Subject(reflectance=Reflectance(*(0.5,) * 6)))
    assert noted_subject(tmp_path) == subject


def test_a_damaged_note_of_the_subject_is_refused_by_name(tmp_path: Path) -> None:
    note_subject(tmp_path, Subject(reflectance=None, metal=METAL))
    path = tmp_path / ".pieces" / "subject.json"
    path.write_text(path.read_text().replace("0.25", '"much"'))
    with pytest.raises(PsvideoError, match=r"subject\.json: cannot be read .* Remove it"):
        noted_subject(tmp_path)


def test_damaged_notes_are_refused_by_name(tmp_path: Path) -> None:
    write_notes(tmp_path, range(3, 5), Found(observed=Observed(lights=("a",))))
    (path,) = (tmp_path / ".pieces").glob("*.npz")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(PsvideoError, match=r"3-5\.npz: cannot be read .* Remove it"):
        list(noted(tmp_path))


def test_two_runs_into_one_folder_are_refused_and_pieces_are_not(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, mark="timing.json", settings="a") as folder:
        (folder / "kept").touch()
        for resume in (False, True):
            with (
                pytest.raises(PsvideoError, match="another run is writing"),
                whole_folder(out, mark="timing.json", resume=resume, settings="a"),
            ):
                pass
        with pytest.raises(PsvideoError, match="another run"), begun_folder(out, mark="timing.json", settings="a"):
            pass
        assert (folder / "kept").is_file()
    other = tmp_path / "other"
    with begun_folder(other, mark="timing.json", settings="a"):
        with begun_folder(other, mark="timing.json", settings="a"):
            pass
        with pytest.raises(PsvideoError, match="another run"), whole_folder(other, mark="timing.json"):
            pass
        with pytest.raises(UsageError, match="other settings"), begun_folder(other, mark="timing.json", settings="b"):
            pass


def test_pieces_replace_what_is_finished_where_that_is_forced(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, mark="timing.json", settings="a") as folder:
        (folder / "timing.json").touch()
        (folder / "old").touch()
    with pytest.raises(AllDoneError), begun_folder(out, mark="timing.json", settings="a"):
        pass
    with begun_folder(out, mark="timing.json", force=True, settings="a") as folder:
        (folder / "timing.json").touch()
    assert (out / "old").is_file()
    with whole_folder(out, mark="timing.json", force=True, resume=True, settings="a"):
        pass
    assert [path.name for path in out.iterdir() if not path.name.startswith(".")] == ["timing.json"]


def test_pieces_cut_in_two_ways_leave_no_instant_out_of_the_report(tmp_path: Path) -> None:
    same_in_pieces(filmed(tmp_path, frames=70), tmp_path, ("1/2", "2/3"), preview=())


def test_a_strobe_s_log_that_came_meanwhile_makes_it_another_run(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=40)
    given = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "out", piece="1/2", **given)  # type: ignore[arg-type]
    caps = capabilities(BOARDS["atmega328p"], "gated")
    board = Ready(identity=Identity(proto=1, board="atmega328p", firmware="1", unit="one"), caps=caps)
    program = make_program(ps.read_plan(clip / "plan.toml"), caps)
    outcome = Outcome(
        started_utc="", stopped_utc="", start_tick=0, cycles=1, ended="done", fault=None, message=None, clock=None
    )
    log = run_log(clip / "plan.toml", board, program, outcome)
    (clip / "strobe.json").write_text(format_log(log))
    with pytest.raises(UsageError, match="other settings, footage, plan"):
        ps.normals(clip, out=tmp_path / "out", resume=True, **given)  # type: ignore[arg-type]
