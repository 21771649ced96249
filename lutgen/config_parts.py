"""The parts of any OpenColorIO config: its views, colour spaces and looks, and the files that it names."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lutgen.bindings import ocio, ocio_errors, unclosed_metadata
from lutgen.errors import LutgenError

if TYPE_CHECKING:
    from collections.abc import Iterator


def all_parts(config: Any) -> Iterator[tuple[str, Any]]:
    """Yield the name of each view, colour space and look, and a transform between it and :func:`first_space`.

    Raises
    ------
    LutgenError
        No colour space of the config holds colours.

    """
    lib, start = ocio(), first_space(config)
    for display in config.getDisplaysAll():
        for view in config.getViews(display):
            yield f"view {view} of {display}", lib.DisplayViewTransform(start, display, view)
    for space in config.getColorSpaceNames(lib.SEARCH_REFERENCE_SPACE_ALL, lib.COLORSPACE_ALL):
        yield f"colour space {space}", lib.ColorSpaceTransform(src=space, dst=start)
        yield f"colour space {space}", lib.ColorSpaceTransform(src=start, dst=space)
    for look in config.getLookNames():
        yield f"look {look}", lib.LookTransform(src=start, dst=start, looks=look)


def first_space(config: Any) -> str:
    """Return a colour space that pictures are in: the role scene_linear or default, else the first with colours.

    Raises
    ------
    LutgenError
        No colour space of the config holds colours.

    """
    roles = [name for name in ("scene_linear", "default") if config.hasRole(name)]
    for name in [*roles, *config.getColorSpaceNames()]:
        # None, where a role names a colour space that is missing.
        space = config.getColorSpace(name)
        if space is not None and not space.isData():
            return str(space.getName())
    raise LutgenError("this config has no colour space that holds colours: nothing can be shown through it.")


def is_utf8(config: Any) -> bool:
    """Whether all names and texts of a config can be decoded; comments are not looked at.

    OpenColorIO takes any bytes, and its Python binding raises UnicodeDecodeError for each name that is not UTF-8.
    """
    lib = ocio()
    try:
        list(config.getColorSpaceNames(lib.SEARCH_REFERENCE_SPACE_ALL, lib.COLORSPACE_ALL))
        for display in config.getDisplaysAll():
            list(config.getViews(display))
        list(config.getLookNames())
        list(config.getSearchPaths())
        sources(config)
        config.serialize()
    except UnicodeDecodeError:
        return False
    except ocio_errors():
        # A config that is not valid cannot be written; that is told apart.
        return True
    return True


def sources(config: Any) -> list[str]:
    """Return the files that a config's transforms name, as written, each once."""
    return list(dict.fromkeys(each.getSrc() for each in file_transforms(config)))


def file_transforms(config: Any) -> Iterator[Any]:
    """Yield every FileTransform of a config, those of inactive colour spaces too."""
    lib = ocio()
    for transform in _transforms(lib, config):
        yield from _files_in(lib, transform)


def _transforms(lib: Any, config: Any) -> Iterator[Any]:
    ways = lib.COLORSPACE_DIR_TO_REFERENCE, lib.COLORSPACE_DIR_FROM_REFERENCE
    for space in config.getColorSpaces(lib.SEARCH_REFERENCE_SPACE_ALL, lib.COLORSPACE_ALL):
        yield from (space.getTransform(way) for way in ways)
    for view in config.getViewTransforms():
        yield view.getTransform(lib.VIEWTRANSFORM_DIR_TO_REFERENCE)
        yield view.getTransform(lib.VIEWTRANSFORM_DIR_FROM_REFERENCE)
    for look in config.getLooks():
        yield from (look.getTransform(), look.getInverseTransform())
    for named in config.getNamedTransforms():
        yield from (named.getTransform(lib.TRANSFORM_DIR_FORWARD), named.getTransform(lib.TRANSFORM_DIR_INVERSE))


def _files_in(lib: Any, transform: Any) -> Iterator[Any]:
    if isinstance(transform, lib.FileTransform):
        yield transform
    elif isinstance(transform, lib.GroupTransform):
        for child in transform:
            yield from _files_in(lib, child)


def endless_file(config: Any) -> Path | None:
    """Return a file that a config names and that OpenColorIO would read for ever; None where there is none."""
    for source in sources(config):
        try:
            path = Path(config.getCurrentContext().resolveFileLocation(source))
        except ocio_errors():
            continue
        if path.is_file() and unclosed_metadata(path):
            return path
    return None


def search_path(config: Any) -> list[str]:
    """Return the folders of a config's search path, without empty entries."""
    return [entry for entry in config.getSearchPaths() if entry]


def leads_out(entry: str) -> bool:
    """Whether a relative folder lies outside the one that it is relative to."""
    return Path(os.path.normpath(entry)).parts[:1] == (os.pardir,)
