"""A scanner's profile combined with the aged display: against matrices and curves in this file."""

import base64
import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lutgen import DisplayModel, read_measurements
from lutgen.bake import icc_profile as icc
from lutgen.bake.check import check
from lutgen.bake.littlecms import source_profile_of, through_profile
from lutgen.display import default_display
from lutgen.errors import LutgenError
from tests.command import Done

pytest.importorskip("imagecodecs", reason="LittleCMS comes with lutgen[icc]")

#: XYZ under D50 of full red, green and blue of Adobe RGB (1998) and of sRGB, from their profiles.
WIDE = np.array([[0.60974, 0.31111, 0.01947], [0.20528, 0.62567, 0.06087], [0.14919, 0.06322, 0.74457]])
SRGB = np.array([[0.43607, 0.22249, 0.01392], [0.38515, 0.71687, 0.09708], [0.14307, 0.06061, 0.71410]])

WHAT = ("build", "--hours", "10000", "--mode", "chroma", "--cubesize", "33", "--jobs", "1", "--format")


def scanner(device_class: bytes = b"scnr") -> bytes:
    tags = icc.display_tags("Scanner", ("a scanner's profile",), WIDE)
    return icc.profile(device_class=device_class, pcs=b"XYZ ", tags=tags)


@pytest.fixture
def built(lutgen: Callable[..., Done], tmp_path: Path) -> Path:
    (tmp_path / "scanner.icc").write_bytes(scanner())
    folder = tmp_path / "built"
    done = lutgen(*WHAT, "icc", "--source-profile", str(tmp_path / "scanner.icc"), "-o", str(folder))
    assert done.code == 0, done.err
    return folder


def test_the_scanners_colours_go_through_the_aged_display(built: Path) -> None:
    code = np.random.default_rng(8).random((20_000, 3))
    light = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4) @ WIDE @ np.linalg.inv(SRGB)
    light = np.clip(light, 0, 1)
    sent = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    wanted = DisplayModel(read_measurements(default_display())).at("chroma", 10_000).code_to_code(sent)
    shown = np.clip(through_profile(built / "chroma/10000h/aged.icc", code), 0, 1)
    error = np.abs(shown - wanted) * 255
    assert error.mean() < 0.1
    # The remaining colours are where the screen clips the scanner's colours: 33³ cannot follow the bend in the dark.
    assert np.quantile(error, 0.99) < 1.3
    assert np.abs(through_profile(built / "chroma/10000h/aged.icc", np.ones((1, 3))) - 1).max() > 0.02  # white has aged


def test_check_needs_no_file_beside_the_build_and_tells_another_profile(built: Path, tmp_path: Path) -> None:
    (tmp_path / "scanner.icc").unlink()
    assert check(built, jobs=1).passed
    path = built / "manifest.json"
    content = json.loads(path.read_text())
    change: dict[str, Callable[[dict[str, Any]], object]] = {
        "is not what the model gives": lambda it: it.pop("source_profile"),
        "source profile cannot be read": lambda it: it.update(source_profile={"file": "a.icc", "zlib_base64": "AAAA"}),
    }
    for words, edit in change.items():
        other = json.loads(json.dumps(content))
        edit(other["options"])
        path.write_text(json.dumps(other))
        assert any(words in each.problem for each in check(built, jobs=1).findings), words


def test_a_stored_profile_that_is_refused_is_refused_in_one_sentence() -> None:
    stored = {"file": "a.icc", "zlib_base64": base64.b64encode(zlib.compress(scanner(b"link"))).decode()}
    with pytest.raises(LutgenError, match=r"^a\.icc: is a profile of class 'link', which does not define"):
        source_profile_of(stored)


BAD = {
    "a link": ("icc", scanner(b"link"), "is a profile of class 'link', which does not define a picture's colours"),
    "no profile": ("icc", b"no profile" * 40, "is no ICC profile"),
    "cut off": ("icc", scanner()[:-40], "Was it cut off?"),
    "empty": ("icc", b"", "is no ICC profile"),
    "another format": ("icc,cube", scanner(), "--source-profile and --format cube do not go together. Pick from: icc"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_a_source_is_refused(what: str, lutgen: Callable[..., Done], tmp_path: Path) -> None:
    formats, data, words = BAD[what]
    (tmp_path / "bad.icc").write_bytes(data)
    done = lutgen(*WHAT, formats, "--source-profile", str(tmp_path / "bad.icc"), "-o", str(tmp_path / "built"))
    assert done.code == 2
    assert words in done.err
    assert not (tmp_path / "built").exists()
