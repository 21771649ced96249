"""Every command takes readings in every supported format, by one registry and two ways of access."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from lutgen import LutgenError
from lutgen.bake import icc_profile as icc
from lutgen.readings import read_campaign, read_measurements
from lutgen.readings.formats import readers
from tests.command import in_process
from tests.session_files import DRIVE, WHITE_CD_M2, light, ti3

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.numbers

ABSOLUTE = (f'LUMINANCE_XYZ_CDM2 "190.09 {WHITE_CD_M2} 217.8"', 'NORMALIZED_TO_Y_100 "YES"')


def rows(*, hours: tuple[float, ...] = (), gain: float = 1.0) -> str:
    """The invented display as a CSV of one session, or of several hours."""
    head = ("hour," if hours else "") + "R,G,B,X_cdm2,Y_cdm2,Z_cdm2\n"
    return head + "".join(
        ",".join(
            [*([f"{hour:g}"] if hours else []), *map(repr, (*code.tolist(), *(gain * WHITE_CD_M2 * xyz).tolist()))]
        )
        + "\n"
        for hour in (hours or (0.0,))
        for code, xyz in zip(DRIVE, light(), strict=True)
    )


def profile(text: str) -> bytes:
    tags = ((b"desc", icc.description("display")), (b"targ", icc.text(text)))
    return icc.profile(device_class=b"mntr", pcs=b"XYZ ", tags=tags)


def in_folder(folder: Path) -> Path:
    """A folder of two sessions and a file without readings."""
    (folder / "life").mkdir()
    (folder / "life" / "a.ti3").write_text(ti3(keywords=ABSOLUTE))
    (folder / "life" / "b.csv").write_text(f"# date: 2021-01-01\n{rows(gain=0.9)}")
    (folder / "life" / "notes.md").write_text("# notes\n")
    return folder / "life"


def campaign(folder: Path) -> Path:
    in_folder(folder)
    text = "".join(f'[[sessions]]\nfile = "life/{name}"\nhours = {h}\n' for name, h in (("a.ti3", 0), ("b.csv", 900)))
    (folder / "campaign.toml").write_text(f'schema = 1\n[display]\nname = "invented"\n{text}')
    return folder / "campaign.toml"


def written(name: str, content: str | bytes) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


CGATS = ti3(kind="CGATS.17", keywords=('NORMALIZED_TO_Y_100 "NO"',), xyz=WHITE_CD_M2 * light())

#: Format → the file or folder, and its number of sessions.
FORMS: dict[str, tuple[Callable[[Path], Path], int]] = {
    ".ti3": (written("a.ti3", ti3(keywords=ABSOLUTE)), 1),
    "CGATS": (
        written("a.txt", ti3(kind="CGATS.17", keywords=('NORMALIZED_TO_Y_100 "NO"',), xyz=WHITE_CD_M2 * light())),
        1,
    ),
    "ICC": (written("a.icc", profile(ti3(keywords=ABSOLUTE))), 1),
    "CSV of one session": (written("a.csv", rows()), 1),
    "CSV with hours": (written("a.csv", rows(hours=(0.0, 900.0))), 2),
    "campaign": (campaign, 2),
    "folder": (in_folder, 2),
}


@pytest.mark.parametrize("form", FORMS)
def test_readings_are_had_as_sessions_and_as_one_table(form: str, tmp_path: Path) -> None:
    write, count = FORMS[form]
    path = write(tmp_path)
    campaign = read_campaign(path)
    assert len(campaign.entries) == count
    first = np.sort(campaign.entries[0].session.xyz_cd_m2, axis=0)  # the order of a CSV's rows has no meaning
    np.testing.assert_allclose(first, np.sort(WHITE_CD_M2 * light(), axis=0), rtol=1e-4, atol=1e-3)
    if form == "folder":
        with pytest.raises(LutgenError, match="dates, which are no operating hours"):
            read_measurements(path)
        return
    readings = read_measurements(path)
    assert sorted(set(readings.hours)) == ([0.0, 900.0] if count == 2 else [0.0])
    assert readings.tips()[1][0, 0, 2] == pytest.approx(WHITE_CD_M2, rel=1e-6)
    assert (readings.order is not None) == (form in {".ti3", "CGATS", "ICC"})


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("command", ["inspect", "compare"])
def test_commands_take_it(
    command: str, form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = FORMS[form][0](tmp_path)
    done = in_process(monkeypatch, capsys, command)(str(path))
    asks_for_hours = form == "folder" and command == "compare"
    assert done.code == (2 if asks_for_hours else 0), done.err
    assert ("hours_per_day" in done.err) == asks_for_hours


@pytest.mark.parametrize("command", [("sessions", "explain"), ("trend",)], ids=" ".join)
@pytest.mark.parametrize("form", ["CSV with hours", "campaign", "folder", ".ti3"])
def test_commands_on_several_sessions_take_it(
    command: tuple[str, ...],
    form: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = FORMS[form][0](tmp_path)
    done = in_process(monkeypatch, capsys, *command)(str(path))
    assert done.code == (2 if form == ".ti3" else 0), done.err
    assert ("one session" in done.err) == (form == ".ti3")
    assert ("Name further files" in done.err) == (form == ".ti3")


def test_an_error_in_a_campaign_names_file_and_line_of_the_reading(tmp_path: Path) -> None:
    path = campaign(tmp_path)
    session = tmp_path / "life" / "b.csv"
    line = next(n for n, text in enumerate(session.read_text().splitlines(), 1) if text.startswith("0.0,1.0,0.0,"))
    lines = session.read_text().splitlines()
    lines[line - 1] = "0.0,1.0,0.0,40.0,-80.0,9.0"
    session.write_text("\n".join(lines) + "\n")
    with pytest.raises(LutgenError, match=rf"b\.csv, line {line}: .*"):
        read_measurements(path)


def test_a_folder_with_a_campaign_file_stands_for_this_file(tmp_path: Path) -> None:
    path = campaign(tmp_path)
    (tmp_path / "life" / "unlisted.csv").write_text(rows(gain=0.5))
    (tmp_path / "unlisted.csv").write_text(rows(gain=0.5))
    (tmp_path / "model.toml").write_text('model = "saved"\n')
    named, found = read_campaign(path), read_campaign(tmp_path)
    assert found.sha256 == named.sha256
    assert found.file == str(path)
    assert found.hours().tolist() == [0.0, 900.0]
    assert read_measurements(tmp_path).hours.tolist() == read_measurements(path).hours.tolist()


def test_a_folder_with_two_campaign_files_a_model_or_without_readings_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match="holds no readings"):
        read_campaign(tmp_path)
    (tmp_path / "model.toml").write_text('model = "saved"\n')
    with pytest.raises(LutgenError, match=r"model\.toml: is a saved model"):
        read_campaign(tmp_path)
    second = campaign(tmp_path).with_name("second.toml")
    second.write_text((tmp_path / "campaign.toml").read_text())
    with pytest.raises(LutgenError, match=r"holds campaign\.toml and second\.toml\. Name the one that lists"):
        read_campaign(tmp_path)


def test_every_reader_says_what_it_is() -> None:
    assert {"CGATS", "CSV of readings", "ICC profile with readings", "campaign file"} <= readers().keys()
    suffixes = [suffix for module in readers().values() for suffix in module.SUFFIXES]
    assert len(suffixes) == len(set(suffixes))
