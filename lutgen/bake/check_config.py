"""Check of an OpenColorIO config: every part is instantiated, and pixels are sent through it.

``validate()`` alone is not enough, since it passes when a LUT file is missing.
"""

import copy
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from lutgen.bake.config import LINEAR, RAW_VIEW, SOURCE, VIEWERS, WORDS, AgedConfig, Words, config_text
from lutgen.bake.expected import config_differs
from lutgen.bake.formats import format_named
from lutgen.bake.manifest import FileRecord, Manifest
from lutgen.bake.plan import direction_of
from lutgen.bindings import is_utf8, named_for_ocio, ocio, ocio_errors, warnings_logged
from lutgen.colorimetry import Array, code_to_linear, inverse, linear_to_code, linear_to_xyz, transform
from lutgen.display import hour_name
from lutgen.errors import LutgenError, in_one_line

#: Takes the path of a LUT; see :func:`check_config`.
Through = Callable[[Path], tuple[Array, Array]]

#: Maximum difference in code values between a config and its own LUT. OpenColorIO's fast power function is accurate to
#: 1e-5. Near black the Rec.1886 curve is steep and can amplify this error ten times.
TOLERANCE = 3e-4

#: Differences in linear light (white is 1) below this limit are also errors of the fast power function. When the
#: display's gamut is wider than the viewer's, a dark channel of the viewer is a difference of bright channels of the
#: display.
LIGHT = 1e-4


def check_config(
    path: Path, root: Path, record: FileRecord, manifest: Manifest, written: AgedConfig, *, through: Through
) -> list[str]:
    """Return the faults of a config of ``manifest``, whose files lie under ``root``.

    The config is compared with ``written``, the newly generated config. If they differ, a display's own config is run
    with the LUT beside it, and the common config is run with every mode and hour. If they are equal, a display's own
    config is run only when its LUT is missing. An equal common config is run with the last hour of the last mode; for
    all other hours only the file that it resolves to is checked.

    ``through`` takes the path of a LUT. It returns the code values to send through the config, and OpenColorIO's
    results for them through the LUT, (n, 3) each. It raises LutgenError when the LUT cannot be read.
    """
    lib = ocio()
    display = record.mode, record.hours
    there = all((root / lut.path).is_file() for lut in manifest.files if (lut.mode, lut.hours) == display)
    if record.mode is not None and there and path.read_bytes() == config_text(written):
        return []
    lib.ClearAllCaches()
    try:
        with warnings_logged(lib) as warnings:
            config = lib.Config.CreateFromFile(named_for_ocio(path))
            config.validate()
        # The config's cache returns the metadata of an equal processor. Two identity LUTs would name the same file.
        config.setProcessorCacheFlags(lib.PROCESSOR_CACHE_OFF)
    except ocio_errors() as error:
        return [f"OpenColorIO {lib.__version__} does not load it: {in_one_line(error)}"]
    problems = [f"OpenColorIO warns: {text}" for text in warnings]
    # A CLF states its own interpolation and a .cube states none. A request for tetrahedral is right for both.
    files = re.findall(r"!<FileTransform>.*", str(config.serialize())) if is_utf8(config) else []
    if not all("interpolation: tetrahedral" in file for file in files):
        problems.append("wrong interpolation: a FileTransform does not ask for tetrahedral")
    differs = config_differs(config, path.read_bytes(), written)
    if differs:
        problems.append(differs)
    words = WORDS[direction_of(manifest)]
    luts = [file for file in manifest.files if file.kind == "lut" and format_named(str(file.format)).reader is None]
    # The LUT that each display's config reads: an unclipped LUT where one exists.
    by_display: dict[tuple[str, float], FileRecord] = {}
    for lut in sorted(luts, key=lambda lut: bool(lut.clipped)):
        by_display.setdefault((str(lut.mode), float(lut.hours or 0.0)), lut)
    if record.mode is None:
        last_mode = next(reversed(by_display), ("", 0.0))[0]
        last = last_mode, max((hours for mode, hours in by_display if mode == last_mode), default=0.0)
        for (mode, hours), lut in by_display.items():
            run = _ConfigRun(config, root / lut.path, words, through=through, context=(mode, hour_name(hours)[:-1]))
            faults = run.problems() if differs or (mode, hours) == last else run.elsewhere(written.lut)
            problems += [f"AGING_MODE={mode}, AGING_HOURS={hour_name(hours)[:-1]}: {fault}" for fault in faults]
        return problems
    if there and not differs:
        return problems
    own = by_display.get((str(record.mode), float(record.hours or 0.0)))
    if own is None:
        return [*problems, "the manifest names no LUT for it"]
    return [*problems, *_ConfigRun(config, root / own.path, words, through=through, context=None).problems()]


class _ConfigRun:
    """The comparison of one config in one context with its LUT."""

    def __init__(
        self, config: Any, lut: Path, words: Words, *, through: Through, context: tuple[str, str] | None
    ) -> None:
        self.config, self.words, self.through, self.lut = config, words, through, lut.resolve()
        self.context = copy.deepcopy(config.getCurrentContext())
        if context:
            self.context["AGING_MODE"], self.context["AGING_HOURS"] = context

    def elsewhere(self, source: str) -> list[str]:
        """Return a fault when the file name ``source`` of the config does not resolve to the LUT."""
        try:
            file = Path(self.context.resolveFileLocation(source)).resolve()
        except ocio_errors() as error:
            return [f"cannot be instantiated: {in_one_line(error)}"]
        return [] if file == self.lut else [f"points elsewhere: {file}"]

    def problems(self) -> list[str]:
        """Return each fault once, with the names of the config's parts that have the fault."""
        try:
            code, aged = self.through(self.lut)
        except LutgenError as error:
            return [str(error)]
        faults: dict[str, list[str]] = {}
        for part_name, part, expected in self._parts(code, aged):
            for problem in self._faults_of(part, code, expected):
                faults.setdefault(problem, []).append(part_name)
        return [f"{problem} ({'; '.join(places)})" for problem, places in faults.items()]

    def _parts(self, code: Array, aged: Array) -> Iterator[tuple[str, Any, Array]]:
        """Yield each part's name, its transform (None when the part is missing), and its expected code values."""
        lib, config, words = ocio(), self.config, self.words
        yield f"look {words.look}", lib.LookTransform(src=SOURCE, dst=SOURCE, looks=words.look), aged
        if set(words.viewers) - set(config.getDisplays()):
            yield f"display {min(set(words.viewers) - set(config.getDisplays()))}", None, aged
        for viewer in config.getDisplays():
            views = set(config.getViews(viewer))
            for missing in sorted({words.view, words.plain_view, RAW_VIEW} - views):
                yield f"display {viewer}, view {missing}", None, aged
            for view in sorted(views):
                light = {words.view: code_to_linear(aged), words.plain_view: code_to_linear(code)}.get(view)
                expected = code if light is None else viewer_values(light, viewer)
                yield f"display {viewer}, view {view}", lib.DisplayViewTransform(SOURCE, viewer, view), expected
        named = config.getNamedTransform(words.named_transform)
        forward = named.getTransform(lib.TRANSFORM_DIR_FORWARD) if named else None
        yield f"named transform {words.named_transform}", forward, aged
        yield f"colour space {words.space}", lib.ColorSpaceTransform(src=words.space, dst=LINEAR), code_to_linear(aged)

    def _faults_of(self, part: Any, code: Array, expected: Array) -> list[str]:
        lib = ocio()
        if part is None:
            return ["missing"]
        try:
            processor = self.config.getProcessor(self.context, part, lib.TRANSFORM_DIR_FORWARD)
            files = [Path(file).resolve() for file in processor.getProcessorMetadata().getFiles()]
            steps = list(processor.createGroupTransform())
            result = code.astype(np.float32)
            processor.getDefaultCPUProcessor().applyRGB(result)
        except ocio_errors() as error:
            return [f"cannot be instantiated: {in_one_line(error)}"]
        problems = [f"points elsewhere: {file}" for file in files if file != self.lut]
        tables = [step for step in steps if isinstance(step, lib.Lut3DTransform)]
        if any(table.getInterpolation() != lib.INTERP_TETRAHEDRAL for table in tables):
            problems.append("wrong interpolation: not tetrahedral")
        shown, expected_shown = np.clip(result, 0, 1), np.clip(expected, 0, 1)
        same_light = np.abs(code_to_linear(shown) - code_to_linear(expected_shown)) <= LIGHT
        difference = np.where(same_light, 0.0, np.abs(shown - expected_shown)).max()
        # `not <=` also finds NaN.
        if not difference <= TOLERANCE:
            problems.append(f"its pixels differ from its LUT's by up to {difference:.4g} in code values")
        return problems


def viewer_values(linear: Array, viewer: str) -> Array:
    """Convert linear sRGB light (n, 3) to a viewer's code values, as ``VIEWERS`` defines them."""
    matrix, curve = VIEWERS.get(viewer, VIEWERS["sRGB"])
    light = transform(inverse(matrix), linear_to_xyz(linear))
    if curve == "srgb":
        return linear_to_code(light)
    return np.asarray(np.maximum(light, 0.0) ** (1.0 / float(curve.removeprefix("power "))))
