"""TOML read strictly: keys, types, lines of errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.toml_table import TomlTable, read_toml


def table_of(tmp_path: Path, text: str) -> TomlTable:
    (tmp_path / "part.toml").write_text(text)
    return read_toml(tmp_path / "part.toml")


def test_what_stands_there_is_taken(tmp_path):
    table = table_of(
        tmp_path,
        'name = "x"\non = true\nmass_kg = 2\nmass_sigma_kg = 0.1\nplace_ned_m = [1, 2, 3]\n'
        "angles = [0.5, 1]\nmatrix = [[1, 2], [3, 4]]\nanything = 1979-05-27\n[part]\nlevel = 3\n",
    )
    assert table.text("name") == "x"
    assert table.flag("on") is True
    assert table.need("mass", "kg") == 2.0
    np.testing.assert_array_equal(table.vector("place", "m", frame="ned"), [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(table.numbers("angles"), [0.5, 1.0])
    np.testing.assert_array_equal(table.numbers("matrix", dimensions=2), [[1.0, 2.0], [3.0, 4.0]])
    assert str(table.raw("anything")) == "1979-05-27"
    part = table.table("part")
    assert part is not None
    assert part.number("level") == 3.0
    assert table.sigma == {"mass_kg": 0.1}
    part.finish()
    table.finish()


def test_what_is_optional_and_absent_is_none_or_the_default(tmp_path):
    table = table_of(tmp_path, "")
    assert table.text("name", required=False) is None
    assert table.flag("on") is False
    assert table.flag("off", default=True) is True
    assert table.number("mass", "kg", required=False) is None
    assert table.vector("place", "m", required=False) is None
    assert table.numbers("angles", required=False) is None
    assert table.raw("anything") is None
    assert table.table("part") is None
    np.testing.assert_array_equal(table.vector("wind", "m_s", default=(0.0, 0.0, 0.0)), [0.0, 0.0, 0.0])
    table.finish()


def test_iteration_is_over_what_was_not_yet_taken(tmp_path):
    table = table_of(tmp_path, "a = 1\nb = 2\nc = 3\n")
    table.number("b")
    assert list(table) == ["a", "c"]
    assert "a" in table
    assert "b" not in table


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[disc]\n\nwrong = 1\n", 3),
        ("disc.wrong = 1\n", 1),
        ("disc = { wrong = 1 }\n", 1),
        ("disc = { other = 2,  wrong = 1 }\n", 1),
        ("# [disc]\n[ disc ] # the disc\nwrong=1\n", 3),
        ('["disc"]\n"wrong" = 1\n', 2),
        ("[disc.part]\nwrong = 1\n[disc]\n  wrong = 1\n", 4),
        ("[disc]\nmatrix = [\n  [1, 2],\n  [0.5]\n]\nwrong = 1\n", 6),
    ],
)
def test_an_unknown_key_is_found_however_it_is_written(tmp_path, text, line):
    table = table_of(tmp_path, text).table("disc", required=True)
    assert table is not None
    for known in ("part", "matrix", "other"):
        table.raw(known)
    with pytest.raises(InputError, match=rf"part\.toml:{line}: unknown key 'disc\.wrong' \(expected part, matrix"):
        table.finish()


def test_nothing_may_stand_where_nothing_is_known(tmp_path):
    with pytest.raises(InputError, match=r"part\.toml:1: unknown key 'x' \(expected nothing here\)"):
        table_of(tmp_path, "x = 1\n").finish()


@pytest.mark.parametrize(
    ("take", "says"),
    [
        (lambda table: table.text("x"), "'x' is 1.5, expected a text"),
        (lambda table: table.flag("x"), "'x' is 1.5, expected true or false"),
        (lambda table: table.table("x"), "'x' is 1.5, expected a table"),
        (lambda table: table.vector("x", ""), "'x' is 1.5, expected a list of 3 numbers"),
        (lambda table: table.numbers("x"), "'x': expected a list of numbers"),
        (lambda table: table.need("x", minimum=2.0), "'x' is 1.5, expected at least 2"),
        (lambda table: table.need("y"), "missing key 'y' in the top level; expected a number"),
    ],
)
def test_a_wrong_type_is_refused_by_key(tmp_path, take, says):
    with pytest.raises(InputError, match=f": {says}$"):
        take(table_of(tmp_path, "x = 1.5\n"))


def test_a_long_value_is_quoted_in_part(tmp_path):
    with pytest.raises(InputError) as caught:
        table_of(tmp_path, f"x = [{', '.join(['1.5'] * 100)}]\n").need("x")
    assert len(str(caught.value)) < len(str(tmp_path)) + 200


@pytest.mark.parametrize(
    ("text", "place"),
    [("a = 1\nb = \n", ":2: "), ("a = [1,\n2", ":2: "), ("a = 1\na = 2\n", ":2: "), ("a = " + "[" * 9999, ": ")],
)
def test_what_is_no_toml_is_refused_with_its_line(tmp_path, text, place):
    with pytest.raises(InputError, match=rf"part\.toml{place}no valid TOML: .*; expected "):
        table_of(tmp_path, text)


def test_an_error_is_one_line_of_printable_characters(tmp_path):
    with pytest.raises(InputError) as caught:
        table_of(tmp_path, '"a\\nb\\u001b[31m" = 1\n').finish()
    assert str(caught.value).isprintable()
    assert r"unknown key 'a\nb\x1b[31m'" in str(caught.value)


@pytest.mark.parametrize("text", ["\\u001b[31mred", "a\\u009b31m", "evil\\u202etxt.exe", "\\u0000"])
def test_a_text_that_a_terminal_would_obey_is_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"'x' is .*, expected a text without control characters") as caught:
        table_of(tmp_path, f'x = "{text}"\n').text("x")
    assert str(caught.value).isprintable()


def test_a_text_may_have_lines_and_letters_of_any_language(tmp_path):
    for text in ("Flug 7, Wurf \u00e4", "\ube44\ud589", "a\\nb\\tc"):
        assert table_of(tmp_path, f'x = "{text}"\n').text("x")


@pytest.mark.parametrize(("value", "positive", "fine"), [(0.5, True, True), (0.0, True, False), (-1.5, False, True)])
def test_only_what_must_be_above_zero_is_refused_where_it_is_not(tmp_path, value, positive, fine):
    table = table_of(tmp_path, f"x_m = {value}\n")
    if fine:
        assert table.number("x", "m", positive=positive) == value
        return
    with pytest.raises(InputError, match=r"'x_m' is 0\.0, expected a number above zero"):
        table.number("x", "m", positive=positive)
