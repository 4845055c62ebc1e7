"""Shoots as somebody asks capture-plan for them, and what it says of each."""

from psvideo.capture.planning import Shoot, plan_shoot
from psvideo.cli.options.capture import ShootWords
from psvideo.cli.options.shoot_words import parse_request


def words(**given_words: object) -> ShootWords:
    usual = {"fps": "100", "size": "64x48", "readout": "9ms", "lights": "key,left,right", "flash": "0.8ms"}
    return ShootWords(**{**usual, **given_words})  # type: ignore[arg-type]


def planned(**given_words: object) -> Shoot:
    return plan_shoot(parse_request(words(**given_words)))


def kinds(shoot: Shoot) -> set[str]:
    return {caution.kind for caution in shoot.cautions}


def text_of(shoot: Shoot, kind: str) -> str:
    return " ".join(caution.text for caution in shoot.cautions if caution.kind == kind)
