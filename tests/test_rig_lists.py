"""Light lists of other programs: what is written is read back to the last digit, and what they cannot hold is said."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from psvideo.cli.app import main
from psvideo.clip.folder import KINDS
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.light_lists.light_list_reader import pictures_named_by
from psvideo.formats.light_lists.light_list_writer import write_rig
from psvideo.formats.light_lists.picture_names import PICTURE_ENDINGS
from psvideo.formats.rig_toml import read_rig
from psvideo.model.rig import Light, Rig, Vector

coordinate = st.floats(-1, 1)
vectors = st.tuples(coordinate, coordinate, st.floats(0.1, 1))
strengths = st.tuples(*[st.floats(0.01, 100)] * 3)


def unit(vector: Vector) -> Vector:
    length = sum(value * value for value in vector) ** 0.5
    return vector[0] / length, vector[1] / length, vector[2] / length


def rig_of(directions: list[Vector], intensity: list[tuple[float, ...]]) -> Rig:
    lights = (
        Light(name=f"light{n}", direction=unit(at), intensity=how)
        for n, (at, how) in enumerate(zip(directions, intensity, strict=True))
    )
    return Rig(lights=tuple(lights))


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(vectors, strengths), min_size=1, max_size=6))
def test_a_rig_survives_the_lists_of_diligent_and_rti(
    tmp_path_factory: pytest.TempPathFactory, lights: list[tuple[Vector, tuple[float, ...]]]
) -> None:
    rig = rig_of([at for at, _ in lights], [how for _, how in lights])
    folder = tmp_path_factory.mktemp("lists")
    for name in ("light_directions.txt", "lights.lp"):
        write_rig(folder / name, rig)
        back = read_rig(folder / name, plan_lights=rig.names)
        for found, given_light in zip(back.lights, rig.lights, strict=True):
            assert found.name == given_light.name
            assert found.direction == pytest.approx(given_light.direction, abs=1e-15)
            assert name == "lights.lp" or found.intensity == given_light.intensity


def test_an_lp_file_is_a_count_and_a_line_for_each_light(tmp_path: Path) -> None:
    lost = write_rig(tmp_path / "a.lp", rig_of([(0, 0, 1), (0.6, 0, 0.8)], [(1.0,), (2.0,)]))
    assert (tmp_path / "a.lp").read_text().split() == [
        "2",
        "light0",
        "0.0",
        "0.0",
        "1.0",
        "light1",
        "0.6",
        "0.0",
        "0.8",
    ]
    assert "differ in theirs" in lost[0]


def test_lights_that_a_list_names_are_the_plans_by_name_whatever_their_order(tmp_path: Path) -> None:
    (tmp_path / "a.lp").write_text("2\nkey 0 0 1\nleft.jpg 0.6 0 0.8\n")
    back = read_rig(tmp_path / "a.lp", plan_lights=("left", "key"))
    assert {one.name: one.direction for one in back.lights} == {"key": (0, 0, 1), "left": (0.6, 0, 0.8)}
    assert read_rig(tmp_path / "a.lp").names == ("key", "left")
    by_order = read_rig(tmp_path / "a.lp", plan_lights=("one", "two"))
    assert [(one.name, one.direction) for one in by_order.lights] == [("one", (0, 0, 1)), ("two", (0.6, 0, 0.8))]


@pytest.mark.parametrize("names", [("a", "a"), ("a/", "a?"), ("", "")])
def test_lights_whose_names_cannot_be_used_are_numbered(names: tuple[str, str], tmp_path: Path) -> None:
    (tmp_path / "a.lp").write_text(f"2\n{names[0]} 0 0 1\n{names[1]} 0.6 0 0.8\n")
    assert read_rig(tmp_path / "a.lp").names == ("L0", "L1")


@pytest.mark.parametrize(
    "text",
    [
        "# 3 lights, measured 2026 11 03\n{0} 0 0 1\n{1} 0.6 0 0.8\n{2} 0 0.6 0.8  # the left one\n",
        "1 {0} 0 0 1\n2 {1} 0.6 0 0.8\n3 {2} 0 0.6 0.8\n",
        "0 0 1 {0}\n0.6 0 0.8 {1}\n0 0.6 0.8 {2}\n",
        'file,x,y,z\n"{0}","0","0","1"\n"{1}","0.6","0","0.8"\n"{2}","0","0.6","0.8"\n',
        "3\n{0} 0 0 1\n{1} 0.6 0 0.8\n{2} 0 0.6 0.8\n",
    ],
    ids=["comments", "numbered lines", "names behind", "quotes", "counted"],
)
@pytest.mark.parametrize("names", [("a.png", "b.png", "c.png"), ("vase 1", "vase 2, left", "vase #3 .png")])
def test_what_stands_beside_a_direction_is_no_part_of_it(tmp_path: Path, text: str, names: tuple[str, ...]) -> None:
    path = tmp_path / "lights.txt"
    path.write_text(text.format(*names))
    lights = read_rig(path).lights
    assert [light.direction for light in lights] == [(0, 0, 1), (0.6, 0, 0.8), (0, 0.6, 0.8)]
    assert [light.intensity for light in lights] == [(1.0,)] * 3
    assert pictures_named_by(path) == names


@pytest.mark.parametrize(
    ("text", "strength"),
    [
        ("1 0 0 1\n2 0.6 0 0.8\n3 0 0.6 0.8\n4 0.8 0 0.6\n", (1.0,)),
        ("0 0 1 1.0\n0.6 0 0.8 1.0\n0 0.6 0.8 1.0\n0.8 0 0.6 1.0\n", (1.0,)),
        ("7 0 0 1 2 3 4\n8 0.6 0 0.8 2 3 4\n9 0 0.6 0.8 2 3 4\n9 0.8 0 0.6 2 3 4\n", (2.0, 3.0, 4.0)),
        ("0 0.6 0 0.8\n0 0 0.6 0\n1 0.8 0.8 0.6\n", (1.0,)),
    ],
    ids=["numbered", "a fourth number", "numbered, with strengths", "in columns"],
)
def test_numbers_of_lines_are_no_directions_and_columns_may_be(
    tmp_path: Path, text: str, strength: tuple[float, ...]
) -> None:
    (tmp_path / "lights.txt").write_text(text)
    lights = read_rig(tmp_path / "lights.txt").lights
    assert [light.direction for light in lights] == [(0, 0, 1), (0.6, 0, 0.8), (0, 0.6, 0.8), (0.8, 0, 0.6)]
    assert {light.intensity for light in lights} == {strength}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 0 1\n0.6 nan 0.8\n0 0.6 0.8\n", "light 2 has only 2 of the three numbers"),
        ("0 0 2 0.9\n0.6 0 0.8 1.1\n0 0.6 0.8 1\n", r"a line has 4 numbers \(0 0 2 0.9\)\. Expected three"),
        ("0 0 1 0\n0 0.6 0.8 0\n0 -0.6 0.8 0\n", "a line has 4 numbers"),
        ("[[0, 0, 1], [0.6, 0, 0.8]]", "is JSON"),
    ],
    ids=["not finite", "nothing of unit length", "two of unit length", "JSON"],
)
def test_lines_that_may_mean_anything_are_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "lights.txt").write_text(text)
    with pytest.raises(PsvideoError, match=said):
        read_rig(tmp_path / "lights.txt")


UNITS = ((0.6, 0, 0.8), (0, 0.6, 0.8), (-0.6, 0, 0.8), (0, -0.6, 0.8))


@pytest.mark.parametrize("count", ["", "4\n"], ids=["plain", "counted"])
@pytest.mark.parametrize("before", ["", "{n} ", "lamp{n} ", "shot {n} "], ids=["bare", "numbered", "named", "counts"])
@pytest.mark.parametrize(
    "strengths",
    [((1.0,), (0.5,), (0.25,), (2.0,)), ((1, 0.5, 2), (2, 1, 4), (0.5, 1, 1), (1, 1, 3))],
    ids=["one", "three"],
)
@pytest.mark.parametrize("kind", ["a.lp", "a.txt"])
def test_strengths_behind_directions_are_the_lights_counted_or_not(
    count: str, before: str, strengths: tuple[tuple[float, ...], ...], kind: str, tmp_path: Path
) -> None:
    if kind == "a.lp" and not count:
        return
    lines = [
        before.format(n=n) + " ".join(map(str, (*at, *how)))
        for n, (at, how) in enumerate(zip(UNITS, strengths, strict=True))
    ]
    (tmp_path / kind).write_text(count + "\n".join(lines))
    back = read_rig(tmp_path / kind)
    assert [light.direction for light in back.lights] == list(UNITS)
    assert [light.intensity for light in back.lights] == list(strengths)
    assert "lamp" not in before or back.names == ("lamp0", "lamp1", "lamp2", "lamp3")


@pytest.mark.parametrize("last", [(0, 0, 0, 0), (1, 2, 3, 4)], ids=["of graphics", "its own number"])
def test_a_fourth_number_that_is_no_strength_is_passed_over(last: tuple[int, ...], tmp_path: Path) -> None:
    at = ((0.6, 0.0, 0.8), (0.0, 0.6, 0.8), (0.8, 0.0, 0.6), (0.48, 0.6, 0.64))
    lines = (f"{x} {y} {z} {n}\n" for (x, y, z), n in zip(at, last, strict=True))
    (tmp_path / "a.txt").write_text("".join(lines))
    lights = read_rig(tmp_path / "a.txt").lights
    assert [light.direction for light in lights] == list(at)
    assert {light.intensity for light in lights} == {(1.0,)}


def test_a_counted_list_may_hold_positions_behind_names_that_end_in_numbers(tmp_path: Path) -> None:
    (tmp_path / "a.lp").write_text("3\nshot 1 0 0 200\nshot 2 60 0 80\nshot 3 0 30 40\n")
    assert [light.direction for light in read_rig(tmp_path / "a.lp").lights] == [
        (0, 0, 1),
        (0.6, 0, 0.8),
        (0, 0.6, 0.8),
    ]
    (tmp_path / "a.lp").write_text("2\na 0.5 10.5 200 1\nb 60 10 80 1\n")
    with pytest.raises(PsvideoError, match="a line has 4 numbers"):
        read_rig(tmp_path / "a.lp")


@pytest.mark.parametrize("count", ["", "2\n"], ids=["plain", "counted"])
def test_six_numbers_whose_first_three_are_no_direction_are_refused(count: str, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(f"{count}10 20 30 1 0.5 1\n20 0 30 1 1 1\n")
    with pytest.raises(PsvideoError, match="a line has 6 numbers"):
        read_rig(tmp_path / "a.txt")


def test_a_light_that_does_not_shine_is_refused_with_its_file_and_name(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("key 0 0 1 1 1 1\nleft 0.6 0 0.8 1 0 1\n")
    with pytest.raises(PsvideoError, match=r"a\.txt: light 2 \('left'\) has the strength 1 0 1"):
        read_rig(tmp_path / "a.txt")
    (tmp_path / "light_directions.txt").write_text("0 0 1\n0.6 0 0.8\n")
    (tmp_path / "light_intensities.txt").write_text("-2 1 1\n1 1 1\n")
    with pytest.raises(PsvideoError, match=r"light_intensities\.txt: light 1 \('L0'\) has the strength -2 1 1"):
        read_rig(tmp_path / "light_directions.txt")


def test_only_endings_of_pictures_are_taken_off_the_names_of_lights(tmp_path: Path) -> None:
    (tmp_path / "a.lp").write_text("3\nkey.left 0 0 1\nkey.top 0.6 0 0.8\nback.JPG 0 0.6 0.8\n")
    assert read_rig(tmp_path / "a.lp").names == ("key.left", "key.top", "back")
    assert set(KINDS) <= set(PICTURE_ENDINGS), "what psvideo reads is a picture"


def test_commas_in_comments_are_no_decimal_commas(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("# lamps 3,5 m away\n0 0 1  # at 2,5 m\n0.6 0 0.8\n0 0.6 0.8\n")
    assert len(read_rig(tmp_path / "a.txt").lights) == 3
    (tmp_path / "a.txt").write_text("# lamps 3.5 m away\n0 0 1\n0,6 0 0,8\n0 0.6 0.8\n")
    with pytest.raises(PsvideoError, match="writes '0,6'"):
        read_rig(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("text", "typed"),
    [
        ("0,1,0,2,0,97\n-0,3,0,2,0,93\n", "Where commas were decimal points, write 0.1 0.2 0.97."),
        ('name,x,y,z\n"a","0,1","0,2","0,97"\n', "writes '0,1'. Expected numbers with points, such as 0.1."),
        ("(0.1 0.2 0.97)\n(-0.3 0.2 0.93)\n", "has brackets ((0.1 0.2 0.97))."),
        ("[0.1,0.2,0.97]\n[-0.3,0.2,0.93]\n", "has brackets ([0.1,0.2,0.97])."),
        ('{"lights": [[0, 0, 1]]}', "is JSON."),
    ],
    ids=["commas for points and spaces", "quoted commas", "round brackets", "square brackets", "JSON"],
)
def test_commas_and_brackets_where_spaces_belong_are_answered_with_what_to_type(
    tmp_path: Path, text: str, typed: str
) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(PsvideoError, match=re.escape(typed)):
        read_rig(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("line", "typed"),
    [
        ("direction = [0.1 0.2 0.97]", "Write commas between the numbers of a list: [0.1, 0.2, 0.97]."),
        ('direction = "0.1 0.2 0.97"', "expected a list, such as [0.1, 0.2, 0.97]."),
        ("direction = [0,1, 0,2, 0,97]", "expected at most 3 values, such as [0.1, 0.2, 0.97]."),
        ("direction = [0, 0, 1]\nintensity = 0,5", "Write numbers with a point: 0.5."),
        ("direction = [0, 0, 1", "Mend that line"),
    ],
)
def test_spaces_and_commas_in_a_rig_where_the_other_belongs_are_answered_with_what_to_type(
    tmp_path: Path, line: str, typed: str
) -> None:
    (tmp_path / "rig.toml").write_text(f'schema = "psvideo-rig/1"\n[[light]]\nname = "a"\n{line}\n')
    with pytest.raises(PsvideoError, match=re.escape(typed)):
        read_rig(tmp_path / "rig.toml")


@pytest.mark.parametrize("apart", [",", " ", "; "])
def test_names_given_as_one_are_answered_with_one_option_for_each(
    tmp_path: Path, apart: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "two.lp").write_text("2\n0 0 1\n0.6 0 0.8\n")
    words = ["calibrate", "convert", str(tmp_path / "two.lp"), "-o", str(tmp_path / "rig.toml")]
    assert main([*words, "--name", f"key{apart}left"]) == 2
    assert "in the list's order: --name key --name left." in " ".join(capsys.readouterr().err.split())


def test_a_near_light_is_in_no_list_and_a_name_that_shows_no_kind_is_refused(tmp_path: Path) -> None:
    near = Rig(lights=(Light(name="lamp", position_m=(1.0, 0.0, 0.0)),))
    for name in ("a.lp", "light_directions.txt"):
        with pytest.raises(PsvideoError, match="'lamp' has a position"):
            write_rig(tmp_path / name, near)
    with pytest.raises(UsageError, match=r"lights\.csv: is no known kind"):
        write_rig(tmp_path / "lights.csv", near)
    assert not list(tmp_path.iterdir())


def test_the_command_converts_there_and_back_and_overwrites_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rig_of([(0, 0, 1), (0.6, 0, 0.8)], [(1.0, 0.9, 0.8), (2.0, 2.0, 2.5)])
    write_rig(tmp_path / "rig.toml", rig)
    lists = tmp_path / "light_directions.txt"
    assert main(["calibrate", "convert", str(tmp_path / "rig.toml"), "-o", str(lists)]) == 0
    assert "hold no names" in capsys.readouterr().err
    back = tmp_path / "back.toml"
    words = ["calibrate", "convert", str(lists), "-o", str(back), "--name", "light0", "--name", "light1", "-q"]
    assert main(words) == 0
    assert read_rig(back) == rig
    assert main(words) == 2


@pytest.mark.parametrize("name", ["psbox_sphere/LightProbe-1/light_directions.txt", "uw_psm/lights.txt"])
def test_measured_lights_of_other_programs_survive_a_round_trip(name: str, shared_data: Path, tmp_path: Path) -> None:
    rig = read_rig(shared_data / name)
    for kind in ("light_directions.txt", "lights.lp"):
        write_rig(tmp_path / kind, rig)
        for found, measured in zip(read_rig(tmp_path / kind).lights, rig.lights, strict=True):
            assert found.direction == pytest.approx(measured.direction, abs=1e-15)


def test_what_coloured_lights_lose_in_a_list_is_said(tmp_path: Path) -> None:
    red = Light(name="red", direction=(0.0, 0.0, 1.0), colour=(1.0, 0.1, 0.0), error_deg=0.3)
    for name in ("a.lp", "light_directions.txt"):
        lost = " ".join(write_rig(tmp_path / name, Rig(lights=(red,), surface_colour=(1.0, 1.0, 1.0))))
        for word in ("no colours of lights", "no errors of directions", "no colour of the surface"):
            assert word in lost


@pytest.mark.parametrize("at", [(0.0, 0.0, 5.0), (0.0, 0.0, float("nan")), (0.0, 0.0, float("inf")), (0.0, 0.0, 0.0)])
def test_a_direction_is_a_unit_vector_of_finite_numbers(at: Vector) -> None:
    with pytest.raises(UsageError, match="`direction`"):
        Light(name="key", direction=at)
    with pytest.raises(UsageError, match="`axis`"):
        Light(name="key", position_m=(0.0, 0.0, 1.0), axis=at)


def test_a_direction_that_people_rounded_is_made_a_unit_vector() -> None:
    rounded = Light(name="key", direction=(0.0, 0.6, 0.805)).direction
    assert rounded is not None
    assert sum(part**2 for part in rounded) == pytest.approx(1, abs=1e-12)
    assert Light(name="key", direction=(0.0, 0.6, 0.8)).direction == (0.0, 0.6, 0.8), "to the bit"


@pytest.mark.parametrize("name", ["#1", "%a", "1e5", "0 1 0"])
def test_a_name_that_an_lp_list_would_read_as_something_else_is_refused(name: str, tmp_path: Path) -> None:
    names = (name, "1 0 0" if name == "0 1 0" else "b", "c")
    directions = ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.6, 0.0, 0.8))
    rig = Rig(tuple(Light(name=one, direction=at) for one, at in zip(names, directions, strict=True)))
    with pytest.raises(PsvideoError, match=r"a\.lp: the lights' names .* would be read as comments or numbers"):
        write_rig(tmp_path / "a.lp", rig)
    assert not (tmp_path / "a.lp").exists()
    write_rig(tmp_path / "a.toml", rig)
    assert read_rig(tmp_path / "a.toml").names == names


@pytest.mark.parametrize(
    "names", [("1", "2", "3"), ("3", "2", "1"), ("key 1", "key 2", "key 3"), ("k#1", "k #2", "10")]
)
def test_other_names_are_written_as_they_are(names: tuple[str, ...], tmp_path: Path) -> None:
    directions = ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.6, 0.0, 0.8))
    rig = Rig(tuple(Light(name=one, direction=at) for one, at in zip(names, directions, strict=True)))
    write_rig(tmp_path / "a.lp", rig)
    assert read_rig(tmp_path / "a.lp").lights == rig.lights


def test_another_number_of_names_than_a_list_has_lights_is_refused_without_a_word_of_a_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "three.txt").write_text("3\n0 0 1\n0.6 0 0.8\n0 0.6 0.8\n")
    words = ["calibrate", "convert", str(tmp_path / "three.txt"), "-o", str(tmp_path / "rig.toml")]
    assert main([*words, "--name", "key", "--name", "left"]) == 2
    said = capsys.readouterr().err
    assert "--name: " in said
    assert "lists 3 lights, and is given 2 names (key, left)" in said.replace("\n", " ")
    assert "plan" not in said
    assert not (tmp_path / "rig.toml").exists()


def test_names_that_a_list_writes_itself_are_not_given_to_other_lights(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Lights that a list names are known by these names, so that others in their place would go unheard."""
    lists, out = tmp_path / "two.lp", tmp_path / "rig.toml"
    lists.write_text("2\nkey.jpg 0 0 1\nleft.jpg 0.6 0 0.8\n")
    words = ["calibrate", "convert", str(lists), "-o", str(out)]
    for names in (("left", "key"), ("top", "key")):
        assert main([*words, *(word for name in names for word in ("--name", name))]) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert f"--name: {lists} names its lights itself (key, left), and some of these" in said
        assert not out.exists()
    assert main([*words, "--name", "key", "--name", "right"]) == 0
    assert read_rig(out).names == ("key", "right"), "a light may keep its own"
