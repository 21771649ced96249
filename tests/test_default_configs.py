import shutil
from pathlib import Path

import pytest

from lutgen.bake.check import check
from tests.check_default_configs import COMMITTED, differences


@pytest.mark.slow(every=True)
def test_the_default_configs_follow_from_the_code() -> None:
    assert differences(COMMITTED) == []


@pytest.mark.slow
def test_the_default_configs_are_true_to_the_model() -> None:
    result = check(COMMITTED)
    assert result.findings == ()
    assert result.files == 31 * 3 * 2 + 1
    assert max(certificate.smooth.max for certificate in result.certificates.values()) <= 0.01


@pytest.mark.slow
def test_a_change_in_the_default_configs_is_found(tmp_path: Path) -> None:
    copy = tmp_path / "default"
    shutil.copytree(COMMITTED, copy)
    lut = copy / "chroma" / "10000h" / "aged.clf"
    lut.write_text(lut.read_text().replace("0.0000000", "0.0000001", 1))
    config = copy / "chroma" / "18000h" / "config.ocio"
    config.write_text(config.read_text().replace("Aged display look", "Some look"))
    (copy / "stray.txt").write_text("?")
    assert differences(copy) == [
        "stray.txt: not made by the code",
        "chroma/10000h/aged.clf: differs",
        "chroma/18000h/config.ocio: differs",
    ]
