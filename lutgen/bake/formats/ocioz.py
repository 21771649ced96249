"""``.ocioz``: a whole OpenColorIO config with its CLF in one archive. OpenColorIO reads archives from version 2.2 on.

An archive is a ZIP with ``config.ocio`` at its root. This module writes it uncompressed and without dates, so that the
same inputs give the same bytes, and so that lutgen with OpenColorIO 2.1 can write it too. OpenColorIO 2.1 reads the
unpacked files back.
"""

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np

from lutgen.bake.config import CONFIG, SOURCE, WORDS, AgedConfig, config_text
from lutgen.bake.formats import Format, Provenance, Reader, clf
from lutgen.bake.lut import Lut, MatrixLut
from lutgen.bake.readback import table_of_ocio
from lutgen.bindings import LARGEST_LUT, named_for_ocio, ocio, ocio_errors
from lutgen.colorimetry import Array
from lutgen.errors import LutgenError, in_one_line
from lutgen.files import scratch

TABLE = "lut.clf"

#: Exceptions for a file that is no archive or is broken.
_BROKEN = (zipfile.BadZipFile, zlib.error, KeyError, EOFError, NotImplementedError, RuntimeError, OSError)

#: The earliest date of a ZIP.
_DATE = (1980, 1, 1, 0, 0, 0)


def _write(lut: Lut | MatrixLut, provenance: Provenance) -> bytes:
    # The wording of the config depends on OpenColorIO's version, but its meaning does not.
    text = f"{provenance.title}. {' '.join(provenance.lines)}"
    config = AgedConfig(provenance.identifier, text, TABLE, words=WORDS[provenance.direction])
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as opened:
        for name, data in ((CONFIG, config_text(config)), (TABLE, clf.FORMAT.write(lut, provenance))):
            entry = zipfile.ZipInfo(name, _DATE)
            # The same on every system: created on Unix, readable by everybody.
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            opened.writestr(entry, data)
    return archive.getvalue()


def files_of(data: bytes) -> dict[str, bytes]:
    """Return the files of an archive by name. Raises LutgenError when the data is no archive."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > LARGEST_LUT:
                raise LutgenError("the archive unpacks to more than any LUT. Build it again.")
            return {name: archive.read(name) for name in archive.namelist()}
    except _BROKEN as error:
        raise LutgenError(f"the archive cannot be unpacked: {error}. Build it again.") from None


def _apply(path: Path, code: Array) -> Array:
    """Apply the archive's look, which does not clip, to code values (n, 3)."""
    lib = ocio()
    lib.ClearAllCaches()
    with _unpacked(path) as folder:
        source = path if hasattr(lib, "ExtractOCIOZArchive") else folder / CONFIG
        try:
            config = lib.Config.CreateFromFile(named_for_ocio(source))
            (name,) = config.getLookNames()
            look = lib.LookTransform(src=SOURCE, dst=SOURCE, looks=name)
            processor = config.getProcessor(look).getDefaultCPUProcessor()
        except ocio_errors() as error:
            raise LutgenError(f"{path}: OpenColorIO {lib.__version__} cannot use it: {in_one_line(error)}") from None
    shown = np.array(code, dtype=np.float32, order="C")
    processor.applyRGB(shown)
    return shown.astype(np.float64)


def _table(path: Path) -> tuple[str, int]:
    with _unpacked(path) as folder:
        return table_of_ocio(folder / TABLE)


@contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Yield a private folder with the config and the table of an archive. Other files in it are not unpacked."""
    with scratch() as folder:
        try:
            with zipfile.ZipFile(path) as archive:
                size = sum(archive.getinfo(name).file_size for name in (CONFIG, TABLE))
                if size > LARGEST_LUT:
                    raise LutgenError(
                        f"{path}: unpacks to {size / 1e6:.0f} MB, more than any LUT. Is it the right file?"
                    )
                for name in (CONFIG, TABLE):
                    archive.extract(name, folder)
        except _BROKEN as error:
            raise LutgenError(f"{path}: is no archive with {CONFIG} and {TABLE}: {error}.") from None
        yield folder


FORMAT = Format(
    name="ocioz",
    suffix=".ocioz",
    unclipped=True,
    write=_write,
    candidates=clf.FORMAT.candidates,
    reader=Reader(_apply, _table),
)
