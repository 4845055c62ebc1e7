"""Whether so much of a clip clips that its flashes cannot be found: what clips shows neither when nor how bright."""

from psvideo.sync.rowfit.profiles import Profiles

MOSTLY = 0.8
"""Share of rows' changes that is of pixels which clip. Of virtual balls and walls all with less are timed, and most
with up to 0.95; from there on what is left is taken for another plan's."""
THROUGHOUT = 0.5
"""Share of its light that a picture may hide in all frames, from which on that it does not change says nothing."""
TOO_BRIGHT = "Film with a smaller aperture, less gain or shorter flashes, so that at most small highlights clip"


def overexposed(rows: Profiles) -> str:
    """Return that nearly all that rows change by are pixels which clip, and what to do; or nothing."""
    share = rows.clipped_share
    if share < MOSTLY:
        return ""
    return (
        f"The picture is overexposed: clipped pixels account for {100 * min(share, 1.0):.0f} % of how its rows change, "
        f"and show neither how bright a flash was nor how much of it a row saw. {TOO_BRIGHT}. If the strobe is still "
        "not found, check that plan.toml is the plan that it played."
    )


def overexposed_throughout(rows: Profiles) -> str:
    """Return that most of a picture that does not change clips in all frames, and what to do; or nothing."""
    if rows.doubt is None or float(rows.doubt.mean()) < THROUGHOUT:
        return ""
    return (
        "no strobe like the plan's was found in the picture: it is overexposed, most of it in all frames, so that "
        f"flashes change nothing. {TOO_BRIGHT}, and with less room light."
    )
