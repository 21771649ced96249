"""One answer to the question why two sessions differ: a set of causes, and its evidence."""

from dataclasses import dataclass

from lutgen.history.colour_points import ColourFit


@dataclass(frozen=True)
class Hypothesis:
    """A set of causes, and how well the set explains white, primaries and black."""

    #: The causes; none: nothing changed.
    names: tuple[str, ...]
    #: The best fit of the causes.
    fit: ColourFit
    #: Natural logarithm of evidence times prior.
    weight: float
    #: Number of causes that are not recorded.
    assumed: int
