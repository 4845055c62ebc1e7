"""How the lights' names are known of all that was followed: a guess wherever one lock's is, and then said to be."""

from collections.abc import Sequence

from psvideo.live.following.follow import Follower
from psvideo.model.marker import HIDDEN_MARKER, has_marker
from psvideo.model.timing import Order

MARK_IT = "Flash a plan whose cycle has a marker, such as a dark slot: names are sure then, after every pause."


def order_of(followed: Sequence[Follower]) -> Order:
    """Return how the names are known throughout; ValueError where nothing was followed."""
    orders: list[Order] = [one.lock.order for one in followed]
    return "guess" if "guess" in orders else max(orders, key=orders.index)


def guess_words(followed: Sequence[Follower], *, first_light: str | None) -> str:
    """Say where names are a guess, and why; "" where they are not. Further locks change nothing in the sentence."""
    guessed = next((one for one in followed if one.lock.order == "guess"), None)
    if guessed is None:
        return ""
    advice = HIDDEN_MARKER if has_marker(guessed.plan) else MARK_IT
    if guessed is not followed[0]:
        found = f"The strobe was lost, and found again at {guessed.lock.at_s:.1f} s: which light is which is a guess"
        known = ", as `first_light` speaks of the first frames alone" if first_light else ""
        return f"{found} from there on{known}. {advice}"
    if first_light:
        return (
            "Which light is which is a guess: `first_light` speaks of the first frames, and the strobe was found in "
            f"later ones. Begin with the lights flashing. {advice}"
        )
    return f"Which light is which is a guess: the picture shows no marker, and `first_light` was not given. {advice}"
