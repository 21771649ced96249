"""Designs of a reader study: balance, rotation, order, and the user's own tables."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lutgen import LutgenError
from lutgen.study.design import (
    PAPER_CONDITIONS,
    UNAGED,
    Design,
    balanced_design,
    condition_of,
    conditions_of,
    read_design,
)
from tests.quick import draws

if TYPE_CHECKING:
    from pathlib import Path

    from lutgen.study.protocol import StudyTrial

pytestmark = pytest.mark.numbers

PAPER = conditions_of(PAPER_CONDITIONS.split(","))


def names(count: int) -> list[str]:
    return [f"i{place:03}" for place in range(count)]


def session(design: Design, reader: int, number: int) -> list[StudyTrial]:
    return [trial for trial in design.trials if (trial.reader, trial.session) == (reader, number)]


# Balance --------------------------------------------------------------------------------------------------------------


def test_the_papers_design_is_120_images_40_under_each_condition_and_all_of_them_again_unaged() -> None:
    design = balanced_design(names(120), PAPER, seed=1)
    first, second = session(design, 1, 1), session(design, 1, 2)
    assert Counter(trial.condition for trial in first) == dict.fromkeys(
        ("none", "chroma@18000", "chroma-luma@18000"), 40
    )
    assert {trial.condition for trial in second} == {"none"}
    assert {trial.image for trial in first} == {trial.image for trial in second} == set(names(120))
    assert [trial.image for trial in first] != [trial.image for trial in second]
    assert (design.readers, design.sessions, design.left_out, len(design.trials)) == (1, 2, (), 240)


#: Conditions, images under each, readers, sessions, and spare images.
SIZES = st.tuples(st.integers(1, 4), st.integers(1, 6), st.integers(1, 5), st.integers(1, 3), st.integers(0, 5))


@draws(60)
@given(sizes=SIZES, seed=st.integers(0, 2**40))
def test_every_design_is_balanced_whole_and_in_blocks(sizes: tuple[int, int, int, int, int], seed: int) -> None:
    count, per_condition, readers, sessions, more = sizes
    conditions = conditions_of([f"chroma@{place}" for place in range(count)])
    images = names(count * per_condition + more)
    design = balanced_design(
        images, conditions, per_condition=per_condition, readers=readers, sessions=sessions, seed=seed
    )
    assert len(design.left_out) == more
    read = set(images) - set(design.left_out)
    for reader in range(1, readers + 1):
        for number in range(1, sessions + 1):
            trials = session(design, reader, number)
            assert [trial.position for trial in trials] == list(range(1, len(read) + 1))
            assert {trial.image for trial in trials} == read
        blocks = np.reshape([trial.condition for trial in session(design, reader, 1)], (per_condition, count))
        for block in blocks:
            assert set(block) == {condition.name for condition in conditions}
    for image in read:
        seen = [t.condition for t in design.trials if t.image == image and t.session == 1]
        # A Latin square: no condition occurs a second time before every condition has occurred.
        assert max(Counter(seen).values()) <= -(-readers // count)
        assert {t.condition for t in design.trials if t.image == image and t.session > 1} <= {"none"}


def test_as_many_readers_as_conditions_read_every_image_under_every_one() -> None:
    design = balanced_design(names(9), PAPER, per_condition=3, readers=3, seed=5)
    pairs = Counter((trial.image, trial.condition) for trial in design.trials if trial.session == 1)
    assert len(pairs) == 27
    assert set(pairs.values()) == {1}


# Chance ---------------------------------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_design_and_another_another() -> None:
    first, again, other = (balanced_design(names(30), PAPER, per_condition=5, seed=seed) for seed in (7, 7, 8))
    assert first == again
    assert first.trials != other.trials
    assert first.left_out != other.left_out


def test_a_reader_or_session_more_changes_nothing_for_the_others() -> None:
    few = balanced_design(names(12), PAPER, per_condition=4, readers=2, sessions=2, seed=3)
    more = balanced_design(names(12), PAPER, per_condition=4, readers=5, sessions=3, seed=3)
    kept = [trial for trial in more.trials if trial.reader <= 2 and trial.session <= 2]
    assert tuple(kept) == few.trials


def test_conditions_are_as_late_as_each_other_in_every_session_and_images_over_many() -> None:
    seeds, count = 300, 12
    late = np.zeros((seeds, 3))
    place = {name: [0.0] * seeds for name in names(count)}
    under = {name: Counter[str]() for name in names(count)}
    for seed in range(seeds):
        trials = session(balanced_design(names(count), PAPER, per_condition=4, seed=seed), 1, 1)
        for column, condition in enumerate(PAPER):
            late[seed, column] = np.mean([trial.position for trial in trials if trial.condition == condition.name])
        for trial in trials:
            place[trial.image][seed] = trial.position
            under[trial.image][trial.condition] += 1
    # Blocks of three: in each session two mean positions differ by at most the first and last place of a block.
    assert np.ptp(late, axis=1).max() <= 2
    # 300 means of four: standard error of the mean position about 0.03.
    assert np.abs(late.mean(axis=0) - 6.5).max() < 0.12
    # The uniform distribution on 1..12 has SD 3.45; the mean of 300 has SD 0.2. Four SD are beyond chance here.
    assert max(abs(np.mean(each) - 6.5) for each in place.values()) < 0.8
    # Binomial(300, 1/3): 100 ± 8.2.
    assert all(abs(count - 100) < 33 for each in under.values() for count in each.values())


def test_later_sessions_order_has_nothing_to_do_with_the_firsts() -> None:
    correlations = []
    for seed in range(200):
        design = balanced_design(names(24), PAPER, per_condition=8, seed=seed)
        first = {trial.image: trial.position for trial in session(design, 1, 1)}
        second = [first[trial.image] for trial in session(design, 1, 2)]
        correlations.append(np.corrcoef(second, range(24))[0, 1])
    # If independent, each correlation has SD 1/√23 and their mean has SD 0.0147.
    assert abs(np.mean(correlations)) < 0.06
    assert np.std(correlations) == pytest.approx(23**-0.5, rel=0.2)


# Conditions and numbers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name", "mode", "hours"),
    [
        ("none", "none", "stable", 0.0),
        (" chroma@18000 ", "chroma@18000", "chroma", 18_000.0),
        ("chroma-luma@0562.50", "chroma-luma@562.5", "chroma-luma", 562.5),
        ("stable@0", "stable@0", "stable", 0.0),
    ],
)
def test_conditions_are_none_or_a_mode_at_an_hour(text: str, name: str, mode: str, hours: float) -> None:
    condition = condition_of(text)
    assert (condition.name, condition.mode, condition.hours) == (name, mode, hours)


@pytest.mark.parametrize(
    "text", ["", "chroma", "chroma@", "blue@5", "chroma@-1", "chroma@nan", "none@5", "chroma@1e3", "chroma@٣"]
)
def test_other_conditions_are_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(LutgenError, match=r"unknown condition .* none .* chroma@18000; modes are stable, chroma,"):
        condition_of(text)


def test_a_condition_named_twice_or_none_at_all_is_refused() -> None:
    with pytest.raises(LutgenError, match="names chroma@5 twice"):
        conditions_of(["chroma@5", "chroma@5.0"])
    with pytest.raises(LutgenError, match="names no condition"):
        conditions_of([])


def test_without_unaged_images_in_session_1_the_later_sessions_bring_their_condition() -> None:
    design = balanced_design(names(2), conditions_of(["chroma@5"]), per_condition=2, seed=0)
    assert design.conditions[-1] == UNAGED
    assert (
        UNAGED not in balanced_design(names(2), design.conditions[:1], per_condition=2, sessions=1, seed=0).conditions
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"per_condition": 4}, "10 images are fewer than .* 3 conditions × 4 images each are 12. Give 2 more, .* 3"),
        ({"per_condition": 0}, "--per-condition 0: give 1 or more"),
        ({"readers": 0, "per_condition": 1}, "--readers 0: give 1 to 1000"),
        ({"sessions": 1001, "per_condition": 1}, "--sessions 1001: give 1 to 1000"),
        (
            {"sessions": 1000, "readers": 1000, "per_condition": 1},
            "3 images × 1000 readers × 1000 sessions are 3000000 readings; a study has at most 200000",
        ),
    ],
)
def test_numbers_that_make_no_study_are_refused(options: dict[str, int], message: str) -> None:
    with pytest.raises(LutgenError, match=message):
        balanced_design(names(10), PAPER, seed=1, **options)


# Tables ---------------------------------------------------------------------------------------------------------------


def table(tmp_path: Path, text: str, readers: int | None = None) -> Design:
    path = tmp_path / "design.csv"
    path.write_text(text, encoding="utf-8")
    return read_design(path, ["a", "b", "c"], readers=readers, seed=1)


def test_a_table_with_positions_is_taken_as_it_is(tmp_path: Path) -> None:
    text = "# mine\nreader,session,position,image,condition\n1,1,2,a,none\n1,1,1,b,chroma@10000\n\n2,1,1,a,chroma@0\n"
    design = table(tmp_path, text)
    assert [(t.reader, t.session, t.position, t.image, t.condition) for t in design.trials] == [
        (1, 1, 1, "b", "chroma@10000"), (1, 1, 2, "a", "none"), (2, 1, 1, "a", "chroma@0"),
    ]  # fmt: skip
    assert [each.name for each in design.conditions] == ["none", "chroma@10000", "chroma@0"]
    assert design.left_out == ("c",)


def test_a_table_for_more_readers_than_can_be_is_refused(tmp_path: Path) -> None:
    rows = "".join(f"{session},a,none\n" for session in range(1, 202))
    with pytest.raises(LutgenError, match=r"201 rows × 1000 readers are 201000 readings; a study has at most 200000"):
        table(tmp_path, f"session,image,condition\n{rows}", 1000)


def test_a_table_without_readers_and_positions_is_for_all_in_orders_drawn(tmp_path: Path) -> None:
    text = "session,image,condition\n1,a,none\n1,b,chroma@5\n1,c,none\n2,c,none\n"
    design = table(tmp_path, text, readers=8)
    assert (design.readers, design.sessions) == (8, 2)
    orders = {tuple(trial.image for trial in session(design, reader, 1)) for reader in range(1, 9)}
    assert len(orders) > 1
    assert {frozenset(order) for order in orders} == {frozenset("abc")}
    assert table(tmp_path, text, readers=8) == design


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no rows. The table needs the header session,image,condition and a line for each row"),
        ("session,image,condition\n", "no rows. The table needs"),
        (
            "session,image\n1,a\n",
            r"line 1: the header is session,image; it must be session,image,condition, and may have reader,position\.",
        ),
        ("session,image,condition,hour\n", "line 1: the header is session,image,condition,hour; it must be"),
        ("session,image,condition,image\n", "line 1: the header is session,image,condition,image; it must be"),
        ("session,image,condition\n1,a\n", "line 2: 2 cells for 3 columns"),
        (
            "session,image,condition\n1,z,none\n",
            r"line 2, column image: 'z' is no image that was given. Given were: a, b, c\.",
        ),
        ("session,image,condition\n\n# so\n1,a,blue@3\n", "line 4, column condition: unknown condition 'blue@3'"),
        ("session,image,condition\n0,a,none\n", r"line 2, column session: '0' is no whole number in 1\.\.1000"),
        ("session,image,condition\n1.5,a,none\n", "line 2, column session: '1.5' is no whole number"),
        ("session,image,condition\n1,a,none\n1,a,chroma@5\n", r"line 3: image a is in session 1 already \(line 2\)"),
        ("session,image,condition\n2,a,none\n", "reader 1 reads nothing in session 1"),
        ("session,image,condition,reader\n1,a,none,1\n2,a,none,1\n1,a,none,2\n", "reader 2 reads nothing in session 2"),
        ("session,image,condition,reader\n1,a,none,\n", "line 2, column reader: '' is no whole number"),
        ("session,image,condition,position\n1,a,none,1\n1,b,none,1\n", "line 3: position 1 where 2 is next"),
        ("session,image,condition,position\n1,a,none,2\n", "line 2: position 2 where 1 is next for reader 1"),
        ('session,image,condition\n1,"a,none\n', "line 2: is no CSV"),
        ("session,image,condition,reader,reader\n1,a,none,1,1\n", "line 1: the header is .*; it must be"),
        (
            "session,image,condition,position\n1,a,none,4\n",
            r"line 2, column position: '4' is no whole number in 1\.\.3",
        ),
    ],
)
def test_a_bad_table_is_refused_with_the_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(LutgenError, match=message):
        table(tmp_path, text)


def test_a_table_that_is_not_there_or_no_text_and_readers_said_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LutgenError, match=r"cannot read the table: no such file.* Give a \.csv with session,"):
        read_design(tmp_path / "gone.csv", ["a"], readers=None, seed=1)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LutgenError, match="is no text in UTF-8"):
        read_design(tmp_path / "binary.csv", ["a"], readers=None, seed=1)
    text = "session,image,condition,reader\n1,a,none,1\n1,a,none,2\n"
    assert table(tmp_path, text, readers=2).readers == 2
    with pytest.raises(LutgenError, match="has readers up to 2, and --readers says 3"):
        table(tmp_path, text, readers=3)
