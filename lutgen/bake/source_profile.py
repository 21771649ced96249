"""The ICC profile that a picture has of its own, such as a slide of its scanner, before the aged display.

Whole-slide viewers convert by the slide's own profile, and a picture has but one. So the scanner's profile and the aged
display become one profile: scanner's code values → sRGB code values, relative to white as viewers convert, clipped as
they are sent to a screen → what the aged display makes of them. The conversion is LittleCMS's.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lutgen.bake.littlecms import screen_code, sound_profile
from lutgen.errors import LutgenError
from lutgen.files import read_at_most

if TYPE_CHECKING:
    from lutgen.colorimetry import Array
    from lutgen.display import AgedDisplay

#: Bytes of a profile, at most: scanners' have some hundred thousand.
LARGEST = 8 << 20

#: Classes of profiles that define the colours of a picture's numbers.
_CLASSES = (b"scnr", b"mntr", b"spac")


@dataclass(frozen=True)
class SourceProfile:
    """A link before the display's first: code values of the picture → code values that a viewer sends to the screen."""

    name: str
    data: bytes = field(repr=False)
    stage: str = "drive"

    def __call__(self, signal: Array) -> Array:
        """(n, 3) code of the picture → (n, 3) code of an sRGB screen, 0..1."""
        return np.clip(screen_code(self.data, signal, self.name), 0.0, 1.0)

    def before(self, aged: AgedDisplay) -> AgedDisplay:
        """Return the display with the picture's profile before it."""
        return replace(aged, head=(self, *aged.head))

    def as_json(self) -> dict[str, str]:
        """Return the whole profile, so that a build can be checked anywhere."""
        return {"file": self.name, "zlib_base64": base64.b64encode(zlib.compress(self.data, 9)).decode()}


def source_profile_of(content: Any) -> SourceProfile:
    """Return the profile of a manifest. Raises LutgenError where it is none."""
    try:
        opened = zlib.decompressobj()
        data = opened.decompress(base64.b64decode(content["zlib_base64"], validate=True), LARGEST)
        return _sound(str(content["file"]), data)
    except (KeyError, TypeError, ValueError, binascii.Error, zlib.error) as error:
        raise LutgenError(f"its source profile cannot be read ({error!r}). Build again.") from None


def read_source_profile(path: str | Path) -> SourceProfile:
    """Read the profile of a scanner, or of a picture. Raises LutgenError where it does not define RGB colours."""
    path = Path(path)
    data = read_at_most(path, LARGEST, what="the source profile", none="ICC profile")
    return _sound(path.name, data)


def _sound(name: str, data: bytes) -> SourceProfile:
    sound_profile(data, name)
    if data[12:16] not in _CLASSES:
        kind = data[12:16].decode("latin-1")
        message = f"{name}: is a profile of class {kind!r}, which tells no picture's colours. Give the scanner's own."
        raise LutgenError(message)
    source = SourceProfile(name, data)
    source(np.eye(3))
    return source


def source_profile_in(aged: AgedDisplay) -> SourceProfile | None:
    """Return the profile before a display, where there is one."""
    match aged.head:
        case (SourceProfile() as source, *_):
            return source
    return None
