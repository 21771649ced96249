"""Names that users type, with an explanation where the name alone is not clear.

This module imports nothing from lutgen. The command line can thus list the names in its help without importing numpy.
The packages that implement the named things import the names from here.
"""

from pathlib import Path

#: Aging mode → meaning.
MODES = {
    "stable": "luminance and chrominance held: the un-aged display at every hour",
    "chroma": "white's luminance held by a sensor, chrominance ages",
    "chroma-luma": "luminance and chrominance age",
}

#: The modes in which the display ages: the rows of the paper's Table 1.
AGING_MODES = ("chroma", "chroma-luma")

#: Rule that selects the matrix of a colour → meaning.
SELECTIONS = {
    "nearest": "the paper: T of the colour point nearest in linear light, ties averaged; jumps at the border to white",
    "continuous": "T' of the smallest channel: no jumps, and all four colour points are met",
}

#: ``relative``: the measured change since hour 0 is applied to the standard sRGB colour points.
#: ``absolute``: the measured colour points are used, scaled so that white at hour 0 has Y = 1.
REFERENCES = ("relative", "absolute")

#: Model of the fresh display → what the model knows of the display.
BASELINES = {
    "colour-points": "white and primaries as measured at each hour",
    "first-hour": "white and primaries of hour 0 alone: all aging comes from the effects",
    "native": "white and primaries as measured at each hour, the display's own model as in the first session",
    "native-first-hour": "the display's own model of the first session alone: all aging comes from the effects",
}

#: Baselines that include the aging without any effects.
AGING_BASELINES = ("colour-points", "native")

#: Baselines that use no measurement after hour 0, and so predict all later readings.
FORETELLING_BASELINES = ("first-hour", "native-first-hour")

#: Baselines that start from the display's own first session.
NATIVE_BASELINES = ("native", "native-first-hour")

#: Direction of a build → meaning.
DIRECTIONS = {
    "simulate": "what the aged display shows, for an un-aged viewer",
    "compensate": "the code values with which the aged display looks un-aged",
}

#: Treatment of colours that the aged display can no longer show → meaning.
UNREACHABLE = {
    "clip": "each channel of the drive is clipped: what can be reached stays exact",
    "scale": "everything is dimmed by one factor, with which no colour needs more than full drive",
}

#: Meaning of the numbers of an image: code values or linear light. ``auto`` decides by the file and its format.
SOURCES = AUTO, SIGNAL, LINEAR = ("auto", "signal", "linear")

#: Stain of tissue → its name and the matrix of scikit-image that separates it, haematoxylin first.
STAINS = {"he": ("H&E", "hed_from_rgb"), "hdab": ("haematoxylin and DAB", "hdx_from_rgb")}

#: Suffix of a numeric map → OpenImageIO's name of the format.
MAP_SUFFIXES = {".exr": "openexr", ".tif": "tiff", ".tiff": "tiff"}

#: Suffixes of the LUT files that OpenColorIO reads, in the order of the formats' names.
LUT_SUFFIXES = (".3dl", ".clf", ".csp", ".cube", ".spi3d")

#: Suffixes of animations.
ANIMATION_SUFFIXES = (".png", ".apng", ".mp4")

#: Figure of the paper → what it shows.
FIGURES = {
    "2": "the un-aged picture, and around it chroma and chroma-luma at 10 000 and 18 000 h",
    "3": "the same of another picture",
    "4": "the same of a third",
    "5": "ΔE2000 against hours, mean ± 2 SD over all pixels",
    "6": "ΔE2000 maps, chroma at 8100 h above chroma-luma at 4100 h, scale 1 to 8",
}

#: Instruments with a known noise: the names of their files.
INSTRUMENTS = tuple(sorted(path.stem for path in Path(__file__).parent.glob("readings/instruments/*.toml")))

#: Published sets of limits for displays.
LIMIT_SETS = TG18_PRIMARY, TG18_SECONDARY, ACR_DIAGNOSTIC, MAMMOGRAPHY, TG270_DIAGNOSTIC, DIN_6868, RANZCR, DRIFT = (
    "tg18-primary",
    "tg18-secondary",
    "acr-diagnostic",
    "mammography",
    "tg270-diagnostic",
    "din-6868-157",
    "ranzcr",
    "drift",
)

#: Interval of a mean → its formula.
INTERVALS = {"normal": "mean ± 1.96 SD/√n, as the paper's Table 2 must be read", "t": "mean ± t SD/√n"}
