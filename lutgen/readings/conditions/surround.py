"""Code value of the grey around a patch that does not fill the screen."""

import numpy as np
from numpy.typing import NDArray

from lutgen.readings.conditions import Column, Condition, Sketch, Values, greys, within
from lutgen.readings.conditions.window import in_words


def _matters(values: Values) -> NDArray[np.bool_]:
    """Return whether each patch has a surround, (n,): the patch does not fill the screen."""
    return np.asarray(values["window"] < 1.0) if "window" in values else np.zeros(values["surround"].size, dtype=bool)


CONDITION = Condition(
    name="surround",
    place=6,
    columns=(
        Column(
            name="surround",
            meaning="the code value around the patch, 0..1",
            blank=0.0,
            usual=0.0,
            unlogged=0.1,
            tried=(0.0, 0.2, 0.5, 1.0),
            shown=1.0,
            axis=(0.0, 1.0),
            words="code value of the surround",
        ),
    ),
    cell="surround",
    span=within(0.02),
    depends="the rest of the picture",
    in_words=in_words,
    label="{:g}".format,
    sentence="in a surround of {}",
    heading="",
    short="surround {:g}",
    before="in a ",
    matters=_matters,
    signatures=lambda values, _rest: {"surround": values["surround"]},
    sketches={
        r".*\b(surround)": Sketch(
            "mixing",
            ("surround",),
            "share of the light in a white surround",
            "linear * (1.0 + {size} * scene.surround)",
        )
    },
    varied=("black in a white surround", greys((0.0, 0.1, 0.2), window=0.1, surround=1.0)),
)
