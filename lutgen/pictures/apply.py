"""``apply_to_image``: write what a picture looks like on an aged display.

The module reads, ages and writes bands of rows in parallel. It treats the picture's code values as the values that are
sent to the display. It copies an ICC profile to the output but does not apply the profile. Linear light (EXR) is
encoded for the display, aged, and written as linear light again. No display can show numbers outside 0..1, so these
numbers are clipped for the aged and for the un-aged display.
"""

from __future__ import annotations

import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from errno import ENOSPC
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bindings import oiio
from lutgen.cells import first_doubled
from lutgen.errors import LutgenError, refuse_unknown
from lutgen.files import check_name, free_bytes, replacing
from lutgen.names import SOURCES
from lutgen.pictures.blocks import threads
from lutgen.pictures.encoding import NotFiniteError, Storage, Stored, not_finite
from lutgen.pictures.engines import ChainEngine, Engine, Shader, TableShader, Unaged, engine_for, shader_for
from lutgen.pictures.images import (
    DTYPES,
    SUFFIXES,
    TIFF,
    ImageFormat,
    ImageSource,
    format_of_suffix,
    is_whole,
    new_by_oiio,
    open_source,
)
from lutgen.progress import Progress, unseen

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from lutgen.display import AgedDisplay
    from lutgen.display.on_screen import OnScreen


#: Bytes reserved for the parts of an image file that are not pixels, such as the ICC profile.
_SPARE = 1 << 20

#: JPEG output: quality, and chroma at full resolution.
JPEG_QUALITY, JPEG_SUBSAMPLING = 95, "4:4:4"

#: Prefixes of metadata that are not copied: they describe how the source file stores its pixels.
_NOT_KEPT = ("oiio:", "tiff:", "jpeg:", "png:", "planarconfig", "textureformat", "openexr:levelmode", "iccprofile:")
_COMPRESSION = ("compression", "compressionquality", "openexr:dwacompressionlevel")


@dataclass(frozen=True)
class AppliedImage:
    """One written image: the aged picture, or the un-aged and the aged picture side by side."""

    #: Paths of the source and of the written image.
    file: str
    output: str
    #: Size in pixels of the written image.
    width: int
    height: int
    #: Encoding of the source's numbers: ``signal`` or ``linear``.
    encoding: str
    #: Share of pixels whose aged colour lies outside the viewer's gamut; None for a LUT, which does not give this
    #: share.
    clipped_share: float | None
    #: Share of the source's pixels that have a number outside 0..1.
    source_clipped_share: float


def apply_to_image(
    image: str | Path,
    output: str | Path,
    aging: AgedDisplay | str | Path,
    *,
    side_by_side: bool = False,
    on_screen: OnScreen | None = None,
    source: str = "auto",
    force: bool = False,
) -> AppliedImage:
    """Write what ``image`` looks like on an aged display.

    Parameters
    ----------
    image
        PNG, JPEG, TIFF or EXR, RGB or RGBA, 8 or 16 bits, half or float.
    output
        Path to write; its suffix sets the format. For an existing folder, or a path that ends in a slash, a file of the
        image's name in this folder. Folders that do not exist are made.
    aging
        A display from ``DisplayModel.at`` (the direct model, in double precision), or the path of a LUT that
        OpenColorIO reads, such as a .cube or .clf.
    side_by_side
        Write the un-aged picture on the left and the aged one on the right.
    on_screen
        Where the picture lies on the screen of ``aging``, which must then be a display; None: all pixels lie at one
        place.
    source
        One of ``SOURCES``: the encoding of the numbers in the file.
    force
        Replace an existing output.

    Raises
    ------
    LutgenError
        The image cannot be read or aged, or the output cannot be written. Then no file is written.

    """
    outputs = outputs_for([Path(image)], output)
    (applied,) = apply_to_images(
        [(Path(image), outputs[0])], aging, side_by_side=side_by_side, on_screen=on_screen, source=source, force=force
    )
    return applied


def outputs_for(images: Sequence[Path], output: str | Path) -> list[Path]:
    """Return the path to write for each image: ``output``, or files of the same names in the folder ``output``.

    A path that ends in a slash is a folder, and so is the output of several images. The folder need not exist.
    """
    into_folder = str(output).endswith(("/", os.sep))
    output = Path(output)
    if len(images) == 1 and not output.is_dir() and not into_folder:
        return [output]
    if output.exists() and not output.is_dir():
        raise LutgenError(f"{output}: is a file, and several images need a folder. Choose another name with -o.")
    if not output.is_dir() and not into_folder and output.suffix.lower() in SUFFIXES:
        raise LutgenError(f"{output}: is the name of one image, and several images need a folder. Give one with -o.")
    twice = first_doubled(image.name for image in images)
    if twice:
        raise LutgenError(f"{output}: two images are named {twice}. Apply to them one after the other.")
    return [output / image.name for image in images]


def apply_to_images(
    pairs: Sequence[tuple[Path, Path]],
    aging: AgedDisplay | str | Path,
    *,
    side_by_side: bool = False,
    on_screen: OnScreen | None = None,
    source: str = "auto",
    force: bool = False,
    progress: Progress = unseen,
) -> list[AppliedImage]:
    """Age several pairs (image, output): all or, on an error, none. ``progress`` gets the rows done and all rows."""
    refuse_unknown("source", source, SOURCES)
    engine = engine_for(aging)
    rows = []
    for image, output in pairs:
        _check_output(image, output, force=force)
        with open_source(image, source) as opened:
            Target(opened, format_of_suffix(output), wide=side_by_side)
            if side_by_side and opened.orientation > 4:
                raise LutgenError(
                    f"{image}: is stored on its side (Orientation): its rows have no left and right. Turn it first."
                )
            if opened.orientation > 1 and not format_of_suffix(output).turns:
                raise LutgenError(
                    f"{image}: asks viewers to turn it (Orientation {opened.orientation}), and {output.suffix} cannot "
                    "say that. Write .jpg, .tif or .exr, or turn the pixels first."
                )
            rows.append(opened.height)
    done: list[AppliedImage] = []
    with _new_folders({output.parent for _, output in pairs}), ExitStack() as stack:
        for number, (image, output) in enumerate(pairs):
            before = sum(rows[:number])
            partial = stack.enter_context(replacing(output))
            with open_source(image, source) as opened:
                target = Target(opened, format_of_suffix(output), wide=side_by_side)
                with target.open(partial):
                    chosen = _placed(aging, on_screen, opened) if on_screen else engine
                    work = _ImageWork(opened, target, chosen, side_by_side=side_by_side)
                    work.run(lambda row, before=before: progress(before + row, sum(rows)))  # type: ignore[misc]
                done.append(work.applied(output))
    return done


@contextmanager
def _new_folders(folders: Collection[Path]) -> Iterator[None]:
    """When the body of the ``with`` statement fails, remove those folders that it created and that are empty."""
    new = {each for folder in folders for each in (folder, *folder.parents) if not each.exists()}
    try:
        yield
    except BaseException:
        for each in sorted(new, key=lambda folder: len(folder.parts), reverse=True):
            with suppress(OSError):
                each.rmdir()
        raise


def _placed(aging: AgedDisplay | str | Path, on_screen: OnScreen, source: ImageSource) -> Engine:
    if isinstance(aging, (str, Path)):
        raise LutgenError(f"{aging}: a LUT does not know where on the screen a pixel lies. Give a display instead.")
    shape, turned = (source.height, source.width), source.orientation
    return ChainEngine(aging, lambda first, count: on_screen.places(first, count, shape, turned))


class _ImageWork:
    """Reads one image band by band, ages each band and writes it."""

    def __init__(self, source: ImageSource, target: Target, engine: Engine, *, side_by_side: bool) -> None:
        self._source, self._target = source, target
        self._shader = shader_for(source.storage, target.storage, engine)
        self._unaged = Shader(source.storage, target.storage, Unaged(target.storage.encoding)) if side_by_side else None
        self._clipped: int | None = 0
        self._source_clipped = 0

    def run(self, progress: Callable[[int], None]) -> None:
        """Age each band while the next band is read and the previous band is written."""
        bands = self._source.bands()
        with ThreadPoolExecutor(2) as files, ThreadPoolExecutor(threads()) as workers:
            reading = files.submit(self._source.read, *bands[0])
            writing: Future[None] | None = None
            for band, following in zip(bands, [*bands[1:], None], strict=True):
                pixels = reading.result()
                if following:
                    reading = files.submit(self._source.read, *following)
                aged = self._aged(pixels, band[0], workers)
                if writing:
                    writing.result()
                writing = files.submit(self._target.write, *band, aged)
                progress(band[1])
            if writing:
                writing.result()

    def applied(self, output: Path) -> AppliedImage:
        """Return the result for the whole image: its size and its shares of clipped pixels."""
        source = self._source
        pixels = source.width * source.height
        return AppliedImage(
            file=str(source.path),
            output=str(output),
            width=int(self._target.spec.width),
            height=source.height,
            encoding=source.storage.encoding,
            clipped_share=None if self._clipped is None else self._clipped / pixels,
            source_clipped_share=self._source_clipped / pixels,
        )

    def _aged(self, pixels: Stored, first_row: int, workers: ThreadPoolExecutor) -> Stored:
        rows, width, channels = pixels.shape
        aged = np.empty((rows * width, channels), self._target.storage.dtype)
        self._shade(self._shader, pixels, aged, first_row, workers)
        aged = aged.reshape(pixels.shape)
        if self._unaged is None:
            return aged
        plain = pixels
        if self._unaged.source != self._unaged.target:
            plain = np.empty(pixels.shape, self._target.storage.dtype)
            self._shade(self._unaged, pixels, plain.reshape(-1, channels), first_row, workers)
        mirrored = self._source.orientation in (2, 3)
        return np.concatenate((aged, plain) if mirrored else (plain, aged), axis=1)

    def _shade(
        self, shader: Shader | TableShader, pixels: Stored, out: Stored, first_row: int, workers: ThreadPoolExecutor
    ) -> None:
        flat = pixels.reshape(len(out), -1)

        def part(start: int) -> Any:
            stop = start + shader.chunk
            try:
                return shader(flat[start:stop], out[start:stop], first_row * self._source.width + start)
            except NotFiniteError as error:
                row, column = divmod(start + error.index, self._source.width)
                raise not_finite(self._source.path, column, first_row + row) from None

        for clipped, source_clipped in workers.map(part, range(0, len(out), shader.chunk)):
            if shader is self._shader:
                self._clipped = None if clipped is None or self._clipped is None else self._clipped + clipped
                self._source_clipped += source_clipped


class Target:
    """An output image that is written band by band."""

    def __init__(self, source: ImageSource, kind: ImageFormat, *, wide: bool) -> None:
        """Choose how the aged ``source`` is stored; ``wide``: the output holds two pictures side by side."""
        if source.storage.alpha and not kind.alpha:
            message = f"{source.path}: has alpha, which {kind.suffixes[0]} cannot keep. Write to .png, .tif or .exr."
            raise LutgenError(message)
        self._lib = oiio()
        self.format = kind
        depth = kind.depths[str(source.spec.format)]
        encoding = source.storage.encoding if kind in (source.format, TIFF) else kind.encoding
        associated = source.storage.alpha and (kind.name == "openexr" or (kind == TIFF and source.storage.associated))
        self.storage = Storage(np.dtype(DTYPES[depth]), encoding, source.storage.alpha, associated)
        self.spec = self._spec(source, depth, wide=wide)

    def _spec(self, source: ImageSource, depth: str, *, wide: bool) -> Any:
        spec = self._lib.ImageSpec(source.spec)
        spec.set_format(self._lib.TypeDesc(depth))
        same_format = self.format == source.format
        compression = str(spec.get_string_attribute("compression"))
        for attribute in source.spec.extra_attribs:
            if not _is_copied(attribute.name.lower(), same_encoding=self.storage.encoding == source.storage.encoding):
                spec.erase_attribute(attribute.name)
        if self.format.lossless:
            spec.attribute("compression", compression if same_format and compression in self.format.lossless else "zip")
        if self.format == TIFF:
            spec.attribute("tiff:RowsPerStrip", source.unit)
        if self.format.name == "jpeg":
            spec.attribute("CompressionQuality", JPEG_QUALITY)
            spec.attribute("jpeg:subsampling", JPEG_SUBSAMPLING)
        if self.storage.alpha and not self.storage.associated:
            spec.attribute("oiio:UnassociatedAlpha", 1)
        if not (self.format.tiles and same_format):
            spec.tile_width = spec.tile_height = spec.tile_depth = 0
        if wide:
            spec.width *= 2
            spec.full_x, spec.full_y, spec.full_width, spec.full_height = spec.x, spec.y, spec.width, spec.height
        return spec

    @contextmanager
    def open(self, partial: Path) -> Iterator[None]:
        """Create the file ``partial``, with any suffix. Raises OSError when the file cannot be created."""
        self._folder = partial.parent
        self._check_room(0)
        with new_by_oiio(partial, self.format.name, self.spec, self._check) as self._image:
            yield
        # libpng reports no error when the disk is full.
        self._check(self.format.name != "png" or is_whole(partial))

    def write(self, first: int, last: int, pixels: Stored) -> None:
        """Write rows ``first`` to ``last`` (exclusive), shape (rows, width, channels)."""
        spec = self.spec
        self._check_room(pixels.nbytes)
        rows = (spec.y + first, spec.y + last)
        if spec.tile_width:
            columns = (spec.x, spec.x + spec.width)
            self._check(self._image.write_tiles(*columns, *rows, spec.z, spec.z + 1, pixels))
        else:
            self._check(self._image.write_scanlines(*rows, spec.z, pixels))

    def _check(self, done: bool) -> None:
        if not done:
            if free_bytes(self._folder) < _SPARE:
                raise OSError(ENOSPC, os.strerror(ENOSPC))
            raise OSError(f"the {self.format.suffixes[0]} file cannot be finished")

    def _check_room(self, size: int) -> None:
        """Raise OSError when ``size`` bytes may not fit on the disk: libjpeg ends the process when the disk is full."""
        # A band in a JPEG file never needs more than twice the bytes of its pixels.
        if self.format.name == "jpeg" and free_bytes(self._folder) < 2 * size + _SPARE:
            raise OSError(ENOSPC, os.strerror(ENOSPC))


def _is_copied(name: str, *, same_encoding: bool) -> bool:
    if name in ("oiio:colorspace", "iccprofile"):
        # A profile of the source's encoding would be wrong for another encoding.
        return same_encoding
    return not name.startswith(_NOT_KEPT) and name not in _COMPRESSION


def _check_output(image: Path, output: Path, *, force: bool) -> None:
    format_of_suffix(output)
    check_name(output)
    above = next((each for each in output.parents if each.exists()), Path())
    if not above.is_dir():
        raise LutgenError(f"{output}: {above} is a file and no folder. Choose another name with -o.")
    if output.is_dir():
        raise LutgenError(f"{output}: is a folder. Choose the name of a file with -o.")
    if output.exists():
        if image.exists() and output.samefile(image):
            raise LutgenError(f"{output}: is the image itself, which is never written to. Choose another name with -o.")
        if not force:
            raise LutgenError(f"{output}: exists already. Choose another name with -o, or replace it with --force.")
