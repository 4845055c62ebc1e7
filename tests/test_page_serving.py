"""The page's server: this machine only, its own files only, and plain words where something is wrong."""

import http.client
import json
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import numpy as np
import page_folder as small
import pytest
from watched_page import serving

from psvideo.errors import PsvideoError, UsageError
from psvideo.page import page_server, show_of
from psvideo.page.serving import PageServer
from psvideo.page.show import index_of


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageServer]:
    folder = small.results(tmp_path_factory.mktemp("page") / "out")
    (folder.parent / "secret.exr").write_bytes(b"nobody's")
    broken = folder / "normals" / "take_normals.1003.exr"
    broken.write_bytes(broken.read_bytes()[:900])
    with serving(folder) as one:
        yield one


def ask(
    server: PageServer, path: str, *, host: str | None = None, method: str = "GET"
) -> tuple[int, bytes, dict[str, str]]:
    """Ask for a path as it is written, not tidied as clients do."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host if host is not None else f"127.0.0.1:{server.server_port}")
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, body, {name.lower(): value for name, value in answer.getheaders()}


def unpacked(body: bytes) -> tuple[dict[str, object], bytes]:
    """Take a block apart as its description says."""
    assert body[:4] == b"PSVB"
    (length,) = struct.unpack("<I", body[4:8])
    assert (8 + length) % 8 == 0
    return json.loads(body[8 : 8 + length]), body[8 + length :]


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.exr",
        "/%2e%2e/secret.exr",
        "/..%2fsecret.exr",
        "//etc/passwd",
        "/etc/passwd",
        "/picture/../../secret.exr",
        "/picture/normals/..%2f..%2fsecret.exr",
        "/picture/..%2f..%2fetc/1001",
        "/picture/..%2fsecret/1001",
        "/picture/normals/../1001",
        "/picture/normals/9999",
        "/picture/normals/-1",
        "/assets/main.js",
        "/__init__.py",
        "/report.json",
        "/normals/take_normals.1001.exr",
        "/index.html/../serving.py",
    ],
)
def test_nothing_but_the_page_and_its_pictures_is_served(server: PageServer, path: str) -> None:
    status, body, _ = ask(server, path)
    assert status == 404
    assert b"nobody" not in body
    assert b"root:" not in body


def test_the_report_beside_the_results_is_shown_and_may_run_nothing(tmp_path: Path) -> None:
    folder = small.results(tmp_path / "out")
    (folder / "report.html").write_text("<!doctype html><p>found</p>", encoding="utf-8")
    show = show_of(folder)
    assert index_of(show)["report"] is True
    with page_server(show, port=0) as one:
        thread = threading.Thread(target=one.serve_forever)
        thread.start()
        status, body, headers = ask(one, "/report.html")
        assert ask(one, "/report.json")[0] == ask(one, "/other.html")[0] == 404
        one.shutdown()
        thread.join()
    assert (status, body) == (200, b"<!doctype html><p>found</p>")
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src" not in policy


@pytest.mark.parametrize(
    "host", ["example.com", "example.com:80", "127.0.0.1", "127.0.0.1:1", "", "127.0.0.1.evil.com"]
)
def test_another_host_name_is_refused(server: PageServer, host: str) -> None:
    for path in ("/", "/index.json", "/picture/normals/1001"):
        status, body, _ = ask(server, path, host=host)
        assert status == 403
        assert b"normals" not in body


def test_it_listens_on_this_machine_only_and_changes_nothing(server: PageServer) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert ask(server, "/", method=method)[0] == 501


def test_the_page_may_load_nothing_from_elsewhere(server: PageServer) -> None:
    for path in ("/", "/main.js", "/style.css", "/index.json", "/picture/normals/1001"):
        status, _, headers = ask(server, path)
        assert status == 200
        assert "default-src 'none'" in headers["content-security-policy"]
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["x-content-type-options"] == "nosniff"


def test_a_picture_comes_as_half_floats_row_by_row(server: PageServer) -> None:
    facts, pixels = unpacked(ask(server, "/picture/albedo/1002")[1])
    assert (facts["width"], facts["height"], facts["channels"], facts["type"]) == (small.COLS, small.ROWS, 3, "half")
    found = np.frombuffer(pixels, "<f2").reshape(small.ROWS, small.COLS, 3)
    assert np.array_equal(found, small.albedo(1002).astype(np.float16))


def test_depth_comes_in_32_bits(server: PageServer) -> None:
    facts, pixels = unpacked(ask(server, "/picture/depth/1002")[1])
    assert (facts["type"], facts["channels"]) == ("float", 1)
    assert len(pixels) == 4 * small.ROWS * small.COLS


def test_smaller_normals_are_unit_vectors_of_the_mean_direction(server: PageServer) -> None:
    facts, pixels = unpacked(ask(server, "/picture/normals/1002?width=32")[1])
    assert (facts["width"], facts["height"]) == (32, 24)
    found = np.frombuffer(pixels, "<f2").reshape(24, 32, 3).astype(np.float64)
    whole, _ = small.ball()
    mean = whole.astype(np.float16).astype(np.float64).reshape(24, 2, 32, 2, 3).mean(axis=(1, 3))
    length = np.linalg.norm(mean, axis=-1, keepdims=True)
    true = np.where(length > 1e-3, mean / np.maximum(length, 1e-3), 0)
    assert np.abs(found - true).max() < 1e-3


def test_a_quick_look_leaves_pixels_out(server: PageServer) -> None:
    facts, pixels = unpacked(ask(server, "/picture/albedo/1002?width=32&quick=1")[1])
    assert (facts["width"], facts["height"]) == (32, 24)
    found = np.frombuffer(pixels, "<f2").reshape(24, 32, 3)
    assert np.array_equal(found, small.albedo(1002).astype(np.float16)[1::2, 1::2])


@pytest.mark.parametrize("width", ["0", "-5", "x", "15", "99999", "1e3", "٣٣"])
def test_a_width_that_is_none_is_refused(server: PageServer, width: str) -> None:
    assert ask(server, f"/picture/normals/1001?width={quote(width)}")[0] == 400


NANOSECONDS = 1732640000123456789


@pytest.mark.parametrize("numbers", [(1732640000, 1732640001), (1732640000123, 1732640000133), (NANOSECONDS,)])
def test_pictures_are_asked_for_by_numbers_as_long_as_times(numbers: tuple[int, ...], tmp_path: Path) -> None:
    normals, _ = small.ball()
    for number in numbers:
        small.write(tmp_path / "normals" / f"take_normals.{number}.exr", small.rgb(normals), number, time_s=0.1)
    with page_server(show_of(tmp_path), port=0) as one:
        thread = threading.Thread(target=one.serve_forever)
        thread.start()
        try:
            for number in numbers:
                written = f"{float(number):.0f}"  # as a browser does, whose numbers are floats
                assert ask(one, f"/picture/normals/{written}")[0] == 200
        finally:
            one.shutdown()
            thread.join()


def test_pictures_have_the_times_that_their_files_say(tmp_path: Path) -> None:
    """Rounds with a dark slot are longer than those without, and the strobe's clock is not the camera's."""
    normals, _ = small.ball()
    times_s = {1001: 0.04, 1002: 0.07, 1003: 0.1, 1004: 0.15, 1007: 0.18}
    for number, time_s in times_s.items():
        for name in ("normals", "albedo"):
            small.write(tmp_path / name / f"take_{name}.{number}.exr", small.rgb(normals), number, time_s=time_s)
    (tmp_path / "albedo" / "take_albedo.1007.exr").unlink()
    show = show_of(tmp_path)
    assert show.sequences[0].times_s == pytest.approx(list(times_s.values()))
    assert show.sequences[1].times_s == pytest.approx(list(times_s.values())[:-1])
    damaged = tmp_path / "normals" / "take_normals.1004.exr"
    damaged.write_bytes(damaged.read_bytes()[:40])
    about_s = show_of(tmp_path).sequences[0].times_s[3]
    assert about_s == pytest.approx(0.1 + 1 / float(small.RATE)), "a round after the nearest that says its time"


def test_a_corrupt_picture_is_missing_and_says_why_while_others_are_there(server: PageServer) -> None:
    facts, pixels = unpacked(ask(server, "/picture/normals/1003")[1])
    assert "take_normals.1003.exr" in str(facts["missing"])
    assert not pixels
    assert "missing" not in unpacked(ask(server, "/picture/normals/1004")[1])[0]


def test_a_port_in_use_is_named_with_what_to_do(server: PageServer) -> None:
    with pytest.raises(UsageError, match=f"`port` {server.server_port}: .*leave `port` out"):
        page_server(server.show, port=server.server_port)


@pytest.mark.parametrize("port", [-1, 99999])
def test_a_port_that_is_none_is_not_laid_upon_another_program(server: PageServer, port: int) -> None:
    with pytest.raises(UsageError, match=f"`port` {port}: expected a number from 1 to 65535"):
        page_server(server.show, port=port)


def test_without_a_port_a_free_one_is_taken(server: PageServer) -> None:
    with page_server(server.show) as one, page_server(server.show) as other:
        assert one.server_port != other.server_port


def test_of_a_folder_of_several_takes_one_is_to_be_named(tmp_path: Path) -> None:
    for name in ("take1", "take2"):
        small.results(tmp_path / "results" / name)
    with pytest.raises(UsageError, match=r"holds results of 2 takes\. Name one, such as .*take1"):
        show_of(tmp_path / "results")


def test_single_flashes_without_plates_are_named(tmp_path: Path) -> None:
    small.results(tmp_path / "out")
    (tmp_path / "out" / "timing.json").rename(tmp_path / "timing.json")
    (tmp_path / "out" / "normals").rename(tmp_path / "flashes")
    with pytest.raises(PsvideoError, match="single flashes and no plates of a light"):
        show_of(tmp_path)


def test_a_folder_that_holds_nothing_to_show_is_named(tmp_path: Path) -> None:
    with pytest.raises(PsvideoError, match=str(tmp_path)):
        show_of(tmp_path)
    with pytest.raises(PsvideoError, match="no such file or folder"):
        show_of(tmp_path / "out")
