"""Share of the screen that a patch covers."""

from collections.abc import Mapping

from lutgen.readings.conditions import Column, Condition, Sketch, within

#: The columns on which the mean of the whole picture depends.
PICTURE = ("window", "surround")

#: White, the primaries, and the secondaries at two levels.
_COLOURS = (
    (1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0),
    (1.0, 1.0, 0.0), (0.6, 0.6, 0.0), (1.0, 0.0, 1.0), (0.6, 0.0, 0.6), (0.0, 1.0, 1.0), (0.0, 0.6, 0.6),
)  # fmt: skip


def in_words(at: Mapping[str, float]) -> str:
    """Return the size of the patch and its surround in words."""
    if at["window"] == 1.0:
        return "full screen"
    return f"a window of {100 * at['window']:g} % in a surround of code value {at['surround']:g}"


CONDITION = Condition(
    name="window",
    place=5,
    columns=(
        Column(
            name="window",
            low=1e-6,
            meaning="the share of the screen that the patch covers, above 0 and up to 1",
            blank=1.0,
            usual=1.0,
            unlogged=0.9,
            tried=(1.0, 0.04, 0.1, 0.5),
            shown=0.1,
            axis=(0.02, 1.0),
            words="share of the screen that the colour covers, on white",
        ),
    ),
    cell="window",
    span=within(0.02),
    depends="the rest of the picture",
    in_words=in_words,
    label="{:g}".format,
    sentence="in windows of {}",
    heading="window",
    short="window {:g}",
    before="in a ",
    axis="share of the screen",
    signatures=lambda values, _rest: {"window": 1.0 - values["window"]},
    sketches={
        r".*\b(window)": Sketch(
            "mixing",
            ("window",),
            "share of the light in a small window",
            "linear * (1.0 + {size} * (1.0 - scene.window))",
        )
    },
    varied=("10 % windows", [(code, {"window": 0.1}, "") for code in _COLOURS]),
)
