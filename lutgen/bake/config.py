"""OpenColorIO configs: one per aging mode and hour, and a common config that selects them by context variables.

Terms: the *source signal* is the code values of the picture that are sent to the display. The *aged display* is the
appearance of these code values on the display. The *viewer* is the un-aged screen of the reader.

One generator writes all configs from their data (``AgedConfig``). The profile version is 2.1, so that OpenColorIO 2.1
loads the configs.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from lutgen.bindings import ocio
from lutgen.colorimetry import LINEAR_TO_XYZ, SRGB_XY, XYZ_TO_LINEAR, Array, inverse, rgb_to_xyz_matrix

#: The name of a config's file.
CONFIG = "config.ocio"

SOURCE, AGED, LINEAR, XYZ = "Source signal", "Aged display", "Linear sRGB", "CIE XYZ-D65"
UNAGED_VIEW, AGED_VIEW, RAW_VIEW = "Un-aged", "Aged", "Raw"
LOOK, NAMED_TRANSFORM = "Aged display look", "Source signal to aged display"

#: SMPTE EG 432-1 primaries with the D65 white.
P3_XY = np.array([SRGB_XY[0], [0.680, 0.320], [0.265, 0.690], [0.150, 0.060]])

#: Viewer → linear-RGB-to-XYZ matrix and curve: the sRGB curve, or the power of Rec. ITU-R BT.1886.
VIEWERS: dict[str, tuple[Array, str]] = {
    "sRGB": (LINEAR_TO_XYZ, "srgb"),
    "Display P3": (rgb_to_xyz_matrix(P3_XY), "srgb"),
    "Rec.1886": (LINEAR_TO_XYZ, "power 2.4"),
}


@dataclass(frozen=True)
class Words:
    """The names and descriptions of a config's parts. ``viewers`` are its screens, in the form of ``VIEWERS``."""

    space: str
    space_text: str
    view: str
    plain_view: str
    plain_text: str
    look: str
    named_transform: str
    viewers: Mapping[str, tuple[Array, str]]
    viewer_name: str
    viewer_text: str


#: Words for a simulation: any screen shows the appearance on the aged display.
SIMULATION = Words(
    AGED,
    "Code values as the aged display shows them.",
    AGED_VIEW,
    UNAGED_VIEW,
    "The source signal on an un-aged display.",
    LOOK,
    NAMED_TRANSFORM,
    VIEWERS,
    "{} viewer",
    "An un-aged {} screen.",
)

#: Words for a correction: the code values to send to one aged display. They are valid for that display only.
CORRECTION = Words(
    "Compensated signal",
    "Code values that the aged display is sent.",
    "Compensated",
    "Uncompensated",
    "The source signal sent to the aged display as it is.",
    "Compensation look",
    "Source signal to compensated signal",
    {AGED: VIEWERS["sRGB"]},
    "{} signal",
    "{}, in the code values that it is sent.",
)

#: Direction of a build → words of its configs.
WORDS = {"simulate": SIMULATION, "compensate": CORRECTION}

#: Roles that Blender, Nuke and later OpenColorIO versions need. ociocheck warns when ``reference`` is not defined.
ROLES = {
    "default": SOURCE,
    "reference": LINEAR,
    "scene_linear": LINEAR,
    "rendering": LINEAR,
    "compositing_linear": LINEAR,
    "compositing_log": SOURCE,
    "color_timing": SOURCE,
    "color_picking": SOURCE,
    "texture_paint": SOURCE,
    "matte_paint": SOURCE,
    "data": "Raw",
    "aces_interchange": "ACES2065-1",
    "cie_xyz_d65_interchange": XYZ,
}

_ALPHANUMERIC = re.compile(r"[A-Za-z0-9]+")

#: Suffixes of images that hold code values, and of images that hold linear light.
SIGNAL_FILES, LINEAR_FILES = ("png", "jpg", "jpeg", "tif", "tiff", "bmp"), ("exr", "hdr")


@dataclass(frozen=True)
class AgedConfig:
    """The content of a config."""

    #: The config's name and description.
    name: str
    description: str
    #: The path of the LUT file, relative to the config. It may contain context variables.
    lut: str
    #: Context variables and their defaults.
    environment: Mapping[str, str] = field(default_factory=dict)
    #: The words of its direction: ``SIMULATION`` or ``CORRECTION``.
    words: Words = SIMULATION


#: Content of a config, without letters and digits of its name and description → one such config, and its text.
_SERIALISED: dict[object, tuple[AgedConfig, bytes]] = {}


def config_text(aged: AgedConfig) -> bytes:
    """Return the config as OpenColorIO serialises it. Versions of OpenColorIO differ in wording, never in meaning.

    OpenColorIO serialises only one config of those whose names and descriptions differ in letters and digits alone.
    Letters and digits do not affect quotes and line breaks. For the other configs the name and the description are
    replaced in this text.
    """
    blanked = _ALPHANUMERIC.sub("a", aged.name), _ALPHANUMERIC.sub("a", aged.description)
    kind = (*blanked, aged.lut, tuple(aged.environment.items()), aged.words.space)
    if kind not in _SERIALISED:
        _SERIALISED[kind] = aged, _serialised(aged)
    like, text = _SERIALISED[kind]
    text = _replaced(rb"(?m)^(name: )%b()$", like.name, aged.name, text)
    text = _replaced(rb"(?m)^( *description: .*)%b(\"?)$", like.description, aged.description, text)
    return text or _serialised(aged)


def _replaced(line: bytes, old: str, new: str, text: bytes) -> bytes:
    """Replace ``old`` by ``new`` on all lines that match the pattern ``line``; return b"" when no line matches."""
    pattern = re.compile(line % re.escape(old.encode()))
    return pattern.sub(lambda match: match[1] + new.encode() + match[2], text) if pattern.search(text) else b""


def _serialised(aged: AgedConfig) -> bytes:
    lib = ocio()
    config = lib.Config()
    config.setMajorVersion(2)
    config.setMinorVersion(1)
    config.setName(aged.name)
    config.setDescription(aged.description)
    config.setSearchPath(".")
    config.setStrictParsingEnabled(True)
    for name, value in aged.environment.items():
        config.addEnvironmentVar(name, value)
    config.setEnvironmentMode(lib.ENV_ENVIRONMENT_LOAD_PREDEFINED)
    _add_colour_spaces(lib, config, aged)
    _add_views(lib, config, aged)
    for role, space in ROLES.items():
        config.setRole(role, space)
    config.setFileRules(_file_rules(lib))
    config.validate()
    return str(config.serialize()).encode()


def _add_colour_spaces(lib: Any, config: Any, aged: AgedConfig) -> None:
    to_linear, words = _srgb_curve(lib), aged.words
    # OpenColorIO's own Bradford-adapted matrices.
    aces_to_xyz = lib.BuiltinTransform(style="UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD")
    from_aces = lib.GroupTransform([aces_to_xyz, _matrix(lib, XYZ_TO_LINEAR)])
    spaces: tuple[tuple[str, str, str, list[str], Any], ...] = (
        (LINEAR, "Linear light of the sRGB primaries.", "scene-linear", ["lin_rec709_srgb", "lin_srgb"], None),
        (SOURCE, "Code values as sent to the display.", "sdr-video", ["srgb", "srgb_tx"], to_linear),
        (words.space, f"{words.space_text} {aged.description}", "sdr-video", [], _aged(lib, aged)),
        ("ACES2065-1", "Interchange with other configs.", "scene-linear", ["aces2065_1"], from_aces),
    )
    for name, description, encoding, aliases, transform in spaces:
        space = lib.ColorSpace(
            referenceSpace=lib.REFERENCE_SPACE_SCENE,
            name=name,
            aliases=aliases,
            family="lutgen",
            encoding=encoding,
            bitDepth=lib.BIT_DEPTH_F32,
            description=description,
            categories=["file-io"],
        )
        if transform is not None:
            space.setTransform(transform, lib.COLORSPACE_DIR_TO_REFERENCE)
        config.addColorSpace(space)
    raw = lib.ColorSpace(name="Raw", family="lutgen", isData=True, description="Code values untouched.")
    config.addColorSpace(raw)
    of_displays = {"referenceSpace": lib.REFERENCE_SPACE_DISPLAY, "family": "Viewer", "encoding": "display-linear"}
    config.addColorSpace(lib.ColorSpace(name=XYZ, **of_displays))


def _add_views(lib: Any, config: Any, aged: AgedConfig) -> None:
    to_xyz, words = _matrix(lib, LINEAR_TO_XYZ), aged.words
    look = lib.Look(name=words.look, processSpace=SOURCE, description=aged.description, transform=_lut(lib, aged))
    config.addLook(look)
    parts = {"family": "lutgen", "description": aged.description, "forwardTransform": _lut(lib, aged)}
    config.addNamedTransform(lib.NamedTransform(name=words.named_transform, **parts))
    steps = [_srgb_curve(lib, encode=True), _aged(lib, aged), to_xyz]
    for name, transform, description in (
        (words.plain_view, to_xyz, words.plain_text),
        (words.view, lib.GroupTransform(steps), aged.description),
    ):
        view = lib.ViewTransform(
            referenceSpace=lib.REFERENCE_SPACE_SCENE, name=name, family="lutgen", description=description
        )
        view.setTransform(transform, lib.VIEWTRANSFORM_DIR_FROM_REFERENCE)
        config.addViewTransform(view)
    config.setDefaultViewTransformName(words.plain_view)
    for viewer, (matrix, curve) in words.viewers.items():
        space = lib.ColorSpace(
            referenceSpace=lib.REFERENCE_SPACE_DISPLAY,
            name=words.viewer_name.format(viewer),
            family="Viewer",
            encoding="sdr-video",
            bitDepth=lib.BIT_DEPTH_F32,
            description=words.viewer_text.format(viewer),
        )
        encoded = lib.GroupTransform([_matrix(lib, inverse(matrix)), _encode(lib, curve)])
        space.setTransform(encoded, lib.COLORSPACE_DIR_FROM_REFERENCE)
        config.addColorSpace(space)
        for name in (words.view, words.plain_view):
            config.addDisplayView(viewer, name, name, words.viewer_name.format(viewer), "", "", "")
        config.addDisplayView(viewer, RAW_VIEW, "Raw", "")
    config.setActiveDisplays(", ".join(words.viewers))
    config.setActiveViews(f"{words.view}, {words.plain_view}, {RAW_VIEW}")


@cache
def _file_rules(lib: Any) -> Any:
    """Return the rules that choose the colour space of a file by its suffix. All configs take copies of them."""
    rules = lib.FileRules()
    for position, (name, space, extensions) in enumerate(
        (("Linear light", LINEAR, LINEAR_FILES), ("Code values", SOURCE, SIGNAL_FILES))
    ):
        patterns = ("".join(f"[{letter.upper()}{letter}]" for letter in extension) for extension in extensions)
        rules.insertRule(position, name, space, rf".*\.({'|'.join(patterns)})$")
    rules.setDefaultRuleColorSpace(SOURCE)
    return rules


def _lut(lib: Any, aged: AgedConfig) -> Any:
    return lib.FileTransform(src=aged.lut, interpolation=lib.INTERP_TETRAHEDRAL)


def _aged(lib: Any, aged: AgedConfig) -> Any:
    """Return the transform from code values to the linear light of the aged display, unclipped if the LUT is."""
    return lib.GroupTransform([_lut(lib, aged), _srgb_curve(lib)])


def _srgb_curve(lib: Any, *, encode: bool = False) -> Any:
    direction = lib.TRANSFORM_DIR_INVERSE if encode else lib.TRANSFORM_DIR_FORWARD
    return lib.ExponentWithLinearTransform(
        gamma=[2.4, 2.4, 2.4, 1.0], offset=[0.055, 0.055, 0.055, 0.0], direction=direction
    )


def _encode(lib: Any, curve: str) -> Any:
    if curve == "srgb":
        return _srgb_curve(lib, encode=True)
    gamma = float(curve.removeprefix("power "))
    return lib.ExponentTransform(value=[gamma, gamma, gamma, 1.0], direction=lib.TRANSFORM_DIR_INVERSE)


def _matrix(lib: Any, matrix: Array) -> Any:
    square = np.eye(4)
    # All versions print and read twelve decimals exactly, but not all digits of a double.
    square[:3, :3] = np.round(matrix, 12)
    return lib.MatrixTransform(matrix=square.ravel().tolist())
