"""Import of OpenColorIO and OpenImageIO, from Debian's packages or PyPI's wheels; LUT files and configs in OpenColorIO.

The code supports OpenColorIO 2.1. It tests whether a newer feature exists before it uses the feature.
"""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from lutgen.errors import LutgenError, in_one_line, reason_of
from lutgen.files import is_unicode

_SOURCES = {
    "PyOpenColorIO": ("OpenColorIO", "python3-pyopencolorio"),
    "OpenImageIO": ("OpenImageIO", "python3-openimageio"),
}

#: Maximum size of a LUT file in bytes: ten times the size of a .cube of 65³.
LARGEST_LUT = 100_000_000

#: Maximum number of points along an edge of a 3D table, and of a 1D curve, that OpenColorIO accepts.
MOST_POINTS, MOST_CURVE_POINTS = 129, 1_048_576

#: The first line of a .csp, and the lines that begin and end its metadata.
_CSP, _METADATA = re.compile(rb"(?i)\s*CSPLUTV100"), re.compile(rb"(?im)^[ \t]*(BEGIN|END) METADATA")

#: The sizes that a .cube states. OpenColorIO 2.1 allocates the memory before it counts the rows.
_CLAIMED = re.compile(rb"(?im)^[ \t]*LUT_([13])D_SIZE[ \t]+([0-9]+)")


def ocio() -> Any:
    """Return the module ``PyOpenColorIO``. Raises LutgenError saying how to install it."""
    return _binding("PyOpenColorIO")


def ocio_errors() -> tuple[type[BaseException], ...]:
    """Return the types of exceptions that calls of OpenColorIO raise.

    ``ExceptionMissingFile`` is no subclass of OpenColorIO's ``Exception``. A message that quotes a binary file raises
    UnicodeDecodeError, since Python cannot decode the message.
    """
    lib = ocio()
    return lib.Exception, lib.ExceptionMissingFile, UnicodeDecodeError


@contextmanager
def warnings_logged(lib: Any) -> Iterator[list[str]]:
    """Yield a list that collects OpenColorIO's log messages, one line each, and suppress their printing."""
    messages: list[str] = []
    lib.SetLoggingFunction(lambda message: messages.append(in_one_line(message)))
    try:
        yield messages
    finally:
        # OpenColorIO would otherwise call the Python function after the interpreter has ended.
        lib.ResetToDefaultLoggingFunction()


def oiio() -> Any:
    """Return the module ``OpenImageIO``. Raises LutgenError saying how to install it."""
    return _binding("OpenImageIO")


def littlecms() -> Any:
    """Return the module ``imagecodecs``, which contains LittleCMS. Raises LutgenError saying how to install it."""
    try:
        return import_module("imagecodecs")
    except ImportError as error:
        raise LutgenError(
            f"ICC profiles are read back through LittleCMS, whose binding cannot be imported ({error}). Install it by "
            f"`pip install lutgen[icc]`; `lutgen build --no-certificates` does not need it."
        ) from None


def optional(module: str, use: str, *, extra: str, otherwise: str) -> Any:
    """Import a module of one of lutgen's extras.

    Raises LutgenError: the module is missing. The message is ``use``, how to install ``extra``, and ``otherwise``.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise LutgenError(
            f"{use}, which cannot be imported ({error}). Install it with `pip install lutgen[{extra}]`, or {otherwise}."
        ) from None


def lut_processor(path: Path) -> Any:
    """Return OpenColorIO's processor for a LUT file of code values, interpolated tetrahedrally.

    Raises LutgenError: the file is missing, empty or too large, its header states a size that OpenColorIO does not
    accept, or OpenColorIO cannot read the file.
    """
    lib, name = ocio(), named_for_ocio(path.absolute())
    refuse_unlikely(path)
    with path.open("rb") as file:
        head = file.read(65_536)
    for dimensions, digits in _CLAIMED.findall(head):
        most = MOST_POINTS if dimensions == b"3" else MOST_CURVE_POINTS
        # A size of more than nine digits is too large in any case, and `int` refuses thousands of digits.
        if len(digits) > 9 or int(digits) > most:
            raise LutgenError(
                f"{path}: claims {digits[:12].decode()} points in {dimensions.decode()}D; OpenColorIO takes at most "
                f"{most}. Ask the author of the file for a smaller table."
            )
    if line := unclosed_metadata(path):
        raise LutgenError(f"{path}:{line}: opens its metadata and never closes them. Write END METADATA after them.")
    # The caches of OpenColorIO use the path as their key, and would return the old content of a rewritten file.
    lib.ClearAllCaches()
    # Links are not resolved: OpenColorIO chooses the reader by the suffix of the given name.
    file_transform = lib.FileTransform(src=name, interpolation=lib.INTERP_TETRAHEDRAL)
    try:
        # OpenColorIO warns where a file of curves alone has no tetrahedra.
        with warnings_logged(lib):
            return _raw_config().getProcessor(file_transform)
    except ocio_errors() as error:
        raise LutgenError(
            f"{path}: OpenColorIO {lib.__version__} cannot read it{_why(error)}. Export it again; `lutgen lint {path}` "
            "lists its faults."
        ) from None


#: Parts of OpenColorIO's error that a message leaves out: what precedes the reason of the first reader, the reasons of
#: other readers, the file's name, and a quoted line.
_NOT_SAID = (
    re.compile(r"^.*?failed with: "),
    re.compile(r" '[^']*' failed with: .*"),
    re.compile(r"Error parsing [^(]*\(.*?\)\. (?=At line)"),
    re.compile(r"(?<=\)): '.*'"),
)
_NAMED = re.compile(r"^Parsing error: '[^']*'")

#: Most characters of OpenColorIO's reason in a message.
_LONGEST_REASON = 160


def _why(error: BaseException) -> str:
    """Return OpenColorIO's first reason after a colon, without the content of the file; "" for no clear reason."""
    if isinstance(error, UnicodeDecodeError):
        return ": it holds bytes that are no text"
    reason = in_one_line(error)
    for part in _NOT_SAID:
        reason = part.sub("", reason, count=1)
    reason = _NAMED.sub("it", reason).rstrip(".")
    clear = reason and reason.isprintable() and reason.isascii() and reason.count("'") % 2 == 0
    return f": {reason}" if clear and len(reason) <= _LONGEST_REASON else ""


@cache
def _raw_config() -> Any:
    lib = ocio()
    config = lib.Config.CreateRaw()
    # The processor cache uses the file name as its key, and the file may be rewritten.
    config.setProcessorCacheFlags(lib.PROCESSOR_CACHE_OFF)
    return config


def named_for_ocio(path: Path) -> str:
    """Return a path as a text for OpenColorIO. Raises LutgenError for a name that is not Unicode."""
    if not is_unicode(path):
        raise LutgenError(f"{str(path)!r}: is no name in UTF-8, as OpenColorIO needs it. Rename it.")
    return str(path)


def unclosed_metadata(path: Path) -> int:
    """Return the line on which a .csp begins metadata without an end; 0 for every other file.

    OpenColorIO 2.1 and 2.6 search for the end of the metadata for ever and fill the memory. The suffix of the file is
    not considered, since OpenColorIO tries all formats on a file whose suffix does not fit.
    """
    with path.open("rb") as file:
        if not _CSP.match(file.read(65_536)):
            return 0
        file.seek(0)
        data = file.read(LARGEST_LUT)
    marks = list(_METADATA.finditer(data))
    if not marks or any(mark[1].upper() == b"END" for mark in marks[1:]):
        return 0
    return data.count(b"\n", 0, marks[0].start()) + 1


def refuse_unlikely(path: Path) -> None:
    """Raise LutgenError unless ``path`` is a readable file of a LUT's size. The file's content is not read."""
    try:
        size = path.stat().st_size
    except OSError as error:
        raise LutgenError(f"{path}: cannot be read: {reason_of(error)}.") from None
    if not path.is_file():
        raise LutgenError(f"{path}: is no file. Give the path of a LUT.")
    if not size:
        raise LutgenError(f"{path}: is empty. Build it again, or copy it again.")
    if size > LARGEST_LUT:
        raise LutgenError(
            f"{path}: has {size / 1e6:.0f} MB, and a LUT has at most {LARGEST_LUT / 1e6:.0f} MB. Is it the right file?"
        )
    if not os.access(path, os.R_OK):
        raise LutgenError(f"{path}: cannot be read: permission denied.")


def _binding(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        # Ctrl-C during the import of a C++ library arrives as an ImportError.
        if isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            raise KeyboardInterrupt from None
        name, debian = _SOURCES[module]
        raise LutgenError(
            f"{name}'s Python binding cannot be imported ({error}). Install Debian's {debian} and use a virtual "
            f"environment with system site packages, or, without administrator rights, `pip install lutgen[wheels]`."
        ) from None


def all_parts(config: Any) -> Iterator[tuple[str, Any]]:
    """Yield the name of each view, colour space and look, and a transform between this part and :func:`first_space`.

    Raises LutgenError: every colour space of the config is a data space.
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
    """Return a colour space for pictures: the role scene_linear or default, else the first that is not a data space.

    Raises LutgenError: every colour space of the config is a data space.
    """
    roles = [name for name in ("scene_linear", "default") if config.hasRole(name)]
    for name in [*roles, *config.getColorSpaceNames()]:
        # The space is None when a role names a colour space that does not exist.
        space = config.getColorSpace(name)
        if space is not None and not space.isData():
            return str(space.getName())
    raise LutgenError("this config has no colour space that holds colours: nothing can be shown through it.")


def is_utf8(config: Any) -> bool:
    """Whether all names and texts of a config are UTF-8. Comments are not checked.

    OpenColorIO accepts any bytes. Its Python binding raises UnicodeDecodeError for each name that is not UTF-8.
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
        # OpenColorIO cannot serialise an invalid config. Another check reports invalid configs.
        return True
    return True


def sources(config: Any) -> list[str]:
    """Return the file names in a config's transforms, as written in the config, each once."""
    return list(dict.fromkeys(each.getSrc() for each in file_transforms(config)))


def file_transforms(config: Any) -> Iterator[Any]:
    """Yield every FileTransform of a config, including those of inactive colour spaces."""
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
    """Return a file of the config that OpenColorIO would read for ever (:func:`unclosed_metadata`); None if none."""
    for source in sources(config):
        try:
            path = Path(config.getCurrentContext().resolveFileLocation(source))
        except ocio_errors():
            continue
        if path.is_file() and unclosed_metadata(path):
            return path
    return None


def active_views(config: Any) -> list[str]:
    """Return the names of a config's active views. OpenColorIO 2.1 gives a text, 2.6 an iterator."""
    active = config.getActiveViews()
    return [view.strip() for view in active.split(",") if view.strip()] if isinstance(active, str) else list(active)


def search_path(config: Any) -> list[str]:
    """Return the folders of a config's search path, without empty entries."""
    return [entry for entry in config.getSearchPaths() if entry]


def leads_out(entry: str) -> bool:
    """Whether a relative path lies outside the folder that it is relative to."""
    return Path(os.path.normpath(entry)).parts[:1] == (os.pardir,)
