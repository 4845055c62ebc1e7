"""The commands in the order of the work, and what the first screen says of each, so that it loads none of them."""

from dataclasses import dataclass

PLAN, MEASURE, SPLIT = "1  Plan and light", "2  Measure cameras and lights", "3  From footage to plates"
SOLVE, LOOK = "4  From plates to normals", "5  Look at it"
TRY = "Try it, and check the installation"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One line of the first screen: the command, the panel it stands in, and its own help's first sentence."""

    name: str
    panel: str
    summary: str

    @property
    def word(self) -> str:
        """The command's module under ``psvideo.cli.commands``, and the name of what it holds."""
        return self.name.replace("-", "_")


def _entries(panel: str, **summaries: str) -> tuple[Entry, ...]:
    return tuple(
        Entry(name=word.replace("_", "-"), panel=panel, summary=summary) for word, summary in summaries.items()
    )


COMMANDS = (
    *_entries(
        PLAN,
        capture_plan="Plan a shoot: write plan.toml, and print its figures and warnings.",
        strobe="Make lights flash as planned: on a board, or on an emulated one.",
    ),
    *_entries(MEASURE, calibrate="Measure cameras and lights before a shoot."),
    *_entries(
        SPLIT,
        live="Show normals and relit light while the camera runs: follow the strobe, solve the newest round.",
        check="Judge a take in seconds, one line for each thing: exit status 0 where it can be used, 1 where not.",
        info="Say what a file or folder is, and whether it fits together: exit status 1 where it does not.",
        sync="Find phase, clock offset, light order and dropped frames of a strobed clip, from the picture alone.",
        split="Rebuild one plate per flash and write one EXR sequence per light, ambient light taken off.",
    ),
    *_entries(
        SOLVE,
        normals="Write normals, albedo and validity for every round of flashes; does sync and split by itself.",
        farm="Write a run as a job for a render farm: an Open Job Description, or a list of shell commands.",
        stills="Write normals, albedo and validity of photographs of a still scene, one per light; no plan is needed.",
    ),
    *_entries(
        LOOK,
        view="Show a result in the browser: scrub, compare, and relight it; only this machine can open the page.",
    ),
    *_entries(
        TRY,
        doctor="Report what is installed, how fast the machine is, and how to fix the rest: exit status 1 if work "
        "stops.",
        demo="Film a virtual bust, find the flashes, solve for normals, and print the path of a picture of it all.",
        synth="Film a virtual scene: a clip folder as a camera would leave it, and the truth beside it in truth/.",
    ),
)
"""Every command; ``tests/test_help.py`` holds the sentences to those of the commands themselves."""
