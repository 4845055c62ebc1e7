"""The page's own files: scripts that can be joined, and colours that every eye can distinguish."""

import re
from pathlib import Path

import numpy as np
import pytest

ASSETS = Path(__file__).resolve().parents[1] / "src" / "psvideo" / "page" / "assets"


def test_scripts_can_be_joined_because_their_names_differ() -> None:
    pattern = re.compile(
        r"^(?:export )?(?:async )?(?:function\*?|const|let|class) (?:\{[^}]*\}|\[[^\]]*\]|(\w+))", re.M
    )
    names = [name for path in ASSETS.glob("*.js") for name in pattern.findall(path.read_text())]
    assert len(names) > 100
    assert len(names) == len(set(names))
    for path in ASSETS.glob("*.js"):
        for line in path.read_text().splitlines():
            assert ("import" not in line.split()) or re.fullmatch(r'import \{ .* \} from "\./[a-z]+\.js";', line), line


def table(name: str) -> np.ndarray:
    """Return a list of colours from palettes.js, (colour, 3), 0 to 1."""
    text = (ASSETS / "palettes.js").read_text()
    inside = re.search(rf"{name} = \[(.*?)\];", text, re.S)
    assert inside is not None
    if "#" in inside[1]:
        return (
            np.array([[int(ink[at : at + 2], 16) for at in (0, 2, 4)] for ink in re.findall(r"#(\w{6})", inside[1])])
            / 255
        )
    return (
        np.array([[float(part) for part in one.split(",")] for one in re.findall(r"\[([\d., ]+)\]", f"[{inside[1]}]")])
        / 255
    )


SIGHTS = {
    "full": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
"""How linear RGB is seen (G. M. Machado et al., 2009, severity 1)."""
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def lab(colours: np.ndarray, sight: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* of sRGB colours as an eye sees them."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ sight.T, 0, 1) @ TO_XYZ.T / np.array([0.9505, 1.0, 1.089])
    root = np.where(seen > 0.008856, np.cbrt(seen), 7.787 * seen + 16 / 116)
    return np.stack([116 * root[:, 1] - 16, 500 * (root[:, 0] - root[:, 1]), 200 * (root[:, 1] - root[:, 2])], axis=-1)


@pytest.mark.parametrize("sight", SIGHTS)
def test_false_colours_only_grow_lighter_and_lights_inks_differ_for_any_eye(sight: str) -> None:
    for name in ("CIVIDIS", "VIRIDIS"):
        lightness = lab(table(name), np.array(SIGHTS[sight]))[:, 0]
        assert (np.diff(lightness) > 3).all()
    inks = lab(table("INKS"), np.array(SIGHTS[sight]))
    apart = np.linalg.norm(inks[:, None] - inks[None], axis=-1)
    assert apart[np.triu_indices(len(inks), 1)].min() > 8
