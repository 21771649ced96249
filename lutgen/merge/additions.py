"""The additions to a user's config for an aged display: colour space, views, look and named transform, and their text.

New parts are inserted into the text of the config, so that its comments, order and digits are preserved. OpenColorIO
serialises the text of the new parts. Only YAML's block style is supported, which all tools write. The result must pass
the proof. If it fails the proof, OpenColorIO's own text of the whole config is used.
"""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from lutgen.bindings import active_views, ocio
from lutgen.colorimetry import XYZ_TO_LINEAR
from lutgen.display import hour_name
from lutgen.errors import LutgenError, pick_one

#: The role of the colour space ACES2065-1.
INTERCHANGE = "aces_interchange"


class AgedNames(NamedTuple):
    """The names of one aged display's parts in a config."""

    space: str
    view: str
    look: str
    named: str

    @classmethod
    def of(cls, prefix: str, mode: str, hours: float) -> "AgedNames":
        """Return the names for a mode and an hour, for example "Aged chroma 10000h"."""
        name = f"{prefix} {mode} {hour_name(hours)}"
        return cls(name, name, f"{name} look", f"{name} transform")


def space_names(config: Any, kind: Any) -> list[str]:
    """Return the names of the colour spaces of an OpenColorIO kind, including inactive ones."""
    return list(config.getColorSpaceNames(kind, ocio().COLORSPACE_ALL))


def check_source(config: Any, name: str) -> None:
    """Raise LutgenError unless the colour space ``name`` exists, is no data space and is scene-referred."""
    lib, space = ocio(), config.getColorSpace(name)
    if space is None:
        raise pick_one("colour space", name, space_names(config, lib.SEARCH_REFERENCE_SPACE_SCENE))
    if space.isData() or space.getReferenceSpaceType() != lib.REFERENCE_SPACE_SCENE:
        why = "holds data" if space.isData() else "belongs to a display"
        raise LutgenError(
            f"--source-space {name}: this colour space {why}. Name a scene-referred one whose code values are sent to "
            "the display, such as sRGB's."
        )
    linear = config.getColorSpace(lib.ROLE_SCENE_LINEAR)
    if space.getEncoding() == "scene-linear" or (linear is not None and linear.getName() == space.getName()):
        raise LutgenError(
            f"--source-space {name}: this colour space is linear light, and the LUT takes code values. Name the colour "
            "space whose code values are sent to the display, such as sRGB's."
        )


def add_source_signal(config: Any, name: str) -> None:
    """Add a colour space of the sRGB signal, by ``INTERCHANGE``. Raises LutgenError: no role, or the name is used."""
    lib = ocio()
    if config.getMajorVersion() < 2 or not config.hasRole(INTERCHANGE):
        choices = space_names(config, lib.SEARCH_REFERENCE_SPACE_SCENE)
        raise LutgenError(
            f"this config has no role {INTERCHANGE}, so the code values that are sent to the display are not defined. "
            f"Give the colour space of sRGB with --source-space NAME, one of: {', '.join(choices)}."
        )
    otherwise = "or give it as --source-space where an earlier merge made it"
    _free(name, space_names(config, lib.SEARCH_REFERENCE_SPACE_ALL), "colour space", otherwise)
    aces = config.getColorSpace(INTERCHANGE)
    square = np.eye(4)
    square[:3, :3] = XYZ_TO_LINEAR
    to_xyz = lib.BuiltinTransform(style="UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD")
    to_linear = lib.MatrixTransform(matrix=square.ravel().tolist())
    from_aces = lib.GroupTransform([to_xyz, to_linear], lib.TRANSFORM_DIR_INVERSE)
    curve = lib.ExponentWithLinearTransform(gamma=[2.4, 2.4, 2.4, 1.0], offset=[0.055, 0.055, 0.055, 0.0])
    signal = lib.ColorSpace(
        referenceSpace=lib.REFERENCE_SPACE_SCENE,
        name=name,
        family="lutgen",
        encoding="sdr-video",
        bitDepth=lib.BIT_DEPTH_F32,
        description="Code values as sent to an sRGB display.",
    )
    to_reference = _one_way(lib, aces, lib.COLORSPACE_DIR_TO_REFERENCE, lib.COLORSPACE_DIR_FROM_REFERENCE)
    steps = [curve, from_aces, *to_reference]
    signal.setTransform(lib.GroupTransform(steps), lib.COLORSPACE_DIR_TO_REFERENCE)
    config.addColorSpace(signal)


def add_aged(config: Any, names: AgedNames, *, source: str, onto: Sequence[str], lut: str) -> None:
    """Add an aged display's parts, and a view on each display of ``onto``. Raises LutgenError: a name is in use."""
    lib = ocio()
    table = lib.FileTransform(src=lut, interpolation=lib.INTERP_TETRAHEDRAL)
    description = f"The code values of {source} as the aged display shows them, on a viewer that is not aged."
    _free(names.space, space_names(config, lib.SEARCH_REFERENCE_SPACE_ALL), "colour space")
    aged = lib.ColorSpace(
        referenceSpace=lib.REFERENCE_SPACE_SCENE,
        name=names.space,
        family="lutgen",
        bitDepth=lib.BIT_DEPTH_F32,
        description=description,
    )
    there, back = lib.COLORSPACE_DIR_FROM_REFERENCE, lib.COLORSPACE_DIR_TO_REFERENCE
    steps = [*_one_way(lib, config.getColorSpace(source), there, back), table]
    aged.setTransform(lib.GroupTransform(steps), there)
    config.addColorSpace(aged)
    _free(names.look, config.getLookNames(), "look")
    config.addLook(lib.Look(name=names.look, processSpace=source, description=description, transform=table))
    if config.getMajorVersion() >= 2:
        _free(names.named, config.getNamedTransformNames(), "named transform")
        config.addNamedTransform(
            lib.NamedTransform(name=names.named, family="lutgen", description=description, forwardTransform=table)
        )
    for display in onto:
        _free(names.view, config.getViews(display), f"view of {display}")
        config.addDisplayView(display, names.view, names.space, "")
    if active := active_views(config):
        config.setActiveViews(", ".join([*active, names.view]))


def _one_way(lib: Any, space: Any, way: Any, back: Any) -> list[Any]:
    """Return a colour space's transform in one direction, or the inverse of the opposite one; an empty list: none."""
    forward, opposite = space.getTransform(way), space.getTransform(back)
    if forward is not None:
        return [forward]
    return [] if opposite is None else [lib.GroupTransform([opposite], lib.TRANSFORM_DIR_INVERSE)]


def _free(name: str, taken: Sequence[str], what: str, otherwise: str = "") -> None:
    # OpenColorIO does not distinguish upper and lower case in names.
    if name.lower() in {each.lower() for each in taken}:
        raise LutgenError(
            f"the config has a {what} {name!r} already. Choose another --prefix{', ' if otherwise else ''}{otherwise}."
        )


#: Sections of a config that hold a list of named parts.
SECTIONS = ("looks", "colorspaces", "named_transforms")


def inserted(text: str, written: str, names: Sequence[str], views: Sequence[tuple[str, AgedNames]]) -> str | None:
    """Return ``text`` with the parts ``names`` of ``written`` and the views (display, names); None: it has no place."""
    lines = _lines(text)
    for section in SECTIONS:
        parts = [part for part in _parts(_lines(written), section) if _name(part) in names]
        if parts:
            lines = _with_parts(lines, section, parts)
    for display, aged in views:
        with_view = _with_view(lines, display, aged)
        if with_view is None:
            return None
        lines = with_view
    with_active = _with_active(lines, list(dict.fromkeys(aged.view for _, aged in views)))
    return None if with_active is None else "\n".join(with_active) + "\n"


def with_search_path(text: str) -> str | None:
    """Return the text of a config with the search path ``.``, below the line of its version; None: no such line."""
    lines = [line for line in _lines(text) if not re.fullmatch(r"search_path:\s*(\"\"|'')?", line)]
    place = next((place for place, line in enumerate(lines) if line.startswith("ocio_profile_version")), None)
    return None if place is None else "\n".join([*lines[: place + 1], "", "search_path: .", *lines[place + 1 :]]) + "\n"


def _lines(text: str) -> list[str]:
    """Split a text at line feeds only, as YAML does. Unicode's line separators do not end a line."""
    return text.removesuffix("\n").split("\n")


def _section(lines: Sequence[str], key: str, indent: int = 0) -> tuple[int, int] | None:
    """Return the index of a key's line and of the first line after its block; None when its value is no block."""
    pattern = re.compile(rf" {{{indent}}}(['\"]?){re.escape(key)}\1:\s*(#.*)?$")
    start = next((place for place, line in enumerate(lines) if pattern.match(line)), None)
    if start is None:
        return None
    end = start + 1
    for place in range(start + 1, len(lines)):
        line = lines[place]
        if line.strip() and not line.lstrip().startswith("#"):
            deeper = len(line) - len(line.lstrip()) > indent
            if not deeper and not (line[indent:].startswith("- ") and line[:indent].isspace() == bool(indent)):
                break
            end = place + 1
    return start, end


def _parts(lines: Sequence[str], section: str) -> list[list[str]]:
    """Return the parts of a section in OpenColorIO's own text, each as a list of lines."""
    place = _section(lines, section)
    parts: list[list[str]] = []
    for line in lines[place[0] + 1 : place[1]] if place else ():
        if line.startswith("  - "):
            parts.append([])
        if parts and line.strip():
            parts[-1].append(line)
    return parts


def _name(part: Sequence[str]) -> str:
    match = re.search(r"name: (.*)", "\n".join(part))
    return match[1].strip("\"'") if match else ""


def _with_parts(lines: Sequence[str], section: str, parts: Sequence[Sequence[str]]) -> list[str]:
    place = _section(lines, section)
    block = [line for part in parts for line in ("", *part)]
    if place is None:
        return [*lines, "", f"{section}:", *block[1:]]
    start, end = place
    first = next((line for line in lines[start + 1 : end] if line.lstrip().startswith("- ")), "  - ")
    shift = len(first) - len(first.lstrip()) - 2
    moved = [(line[-shift:] if shift < 0 else " " * shift + line) if line else "" for line in block]
    return [*lines[:end], *moved, *lines[end:]]


def _with_view(lines: Sequence[str], display: str, aged: AgedNames) -> list[str] | None:
    section = _section(lines, "displays")
    if section is None:
        return None
    first = next((line for line in lines[section[0] + 1 : section[1]] if line.strip() and line.lstrip()[0] != "#"), "")
    inside = _section(lines[section[0] + 1 : section[1]], display, len(first) - len(first.lstrip()))
    if inside is None:
        return None
    start, end = (section[0] + 1 + place for place in inside)
    item = next((line for line in lines[start + 1 : end] if line.lstrip().startswith("- ")), None)
    if item is None:
        return None
    view = f"{item[: len(item) - len(item.lstrip())]}- !<View> {{name: {aged.view}, colorspace: {aged.space}}}"
    return [*lines[:end], view, *lines[end:]]


def _with_active(lines: Sequence[str], views: Sequence[str]) -> list[str] | None:
    """Return the lines with views added to active_views; None when active_views extends over several lines."""
    changed = list(lines)
    for place, line in enumerate(lines):
        if line.startswith("active_views:"):
            head, bracket, rest = line.rpartition("]")
            if not bracket or head.count("[") != 1:
                return None
            inside = head.partition("[")[2].strip()
            if inside:
                changed[place] = f"{head.rstrip(', ')}, {', '.join(views)}]{rest}"
    return changed
