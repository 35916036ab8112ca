"""What is shipped can be listed and shown by name."""

from __future__ import annotations

import pytest

from discsim.effects import CATALOGUE
from discsim.errors import InputError
from discsim.files import model_file, model_names
from discsim.listing import KINDS, listed, namesakes, shown
from discsim.shipped import load_disc


@pytest.mark.parametrize("kind", list(KINDS))
def test_each_kind_is_listed_whole_with_a_line_on_each(kind):
    expected = list(CATALOGUE) if kind == "effects" else model_names(KINDS[kind])
    found = listed(kind)
    assert list(found) == expected
    assert all(5 < len(line) <= 100 for line in found.values())


def test_a_name_of_two_kinds_shows_the_disc_and_tells_the_throw():
    disc, throw = (model_file(f"{kind}/driver.toml").read_text(encoding="utf-8") for kind in ("discs", "throws"))
    assert shown("driver") == f"# discs/driver\n{disc}"
    assert namesakes("driver") == ["throws/driver"]
    assert shown("throws/driver") == f"# throws/driver\n{throw}"
    assert namesakes("throws/driver") == namesakes("mpu9250") == []


def test_what_is_shown_can_be_kept_and_flown(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(shown("driver"), encoding="utf-8")
    assert load_disc(str(mine))[0].mass == load_disc("driver")[0].mass


def test_an_effect_is_shown_with_its_parameters_and_an_example_that_can_be_typed():
    text = shown("air.wind")
    assert "parameter: w_north_m_s" in text
    assert "--effect air.wind:w_north_m_s=" in text


@pytest.mark.parametrize("id", list(CATALOGUE))
def test_every_effect_can_be_shown(id):
    assert shown(id).startswith(f"# effects/{id}\n")


def test_an_unknown_name_or_kind_is_refused_with_what_is_near():
    with pytest.raises(InputError, match="nothing is called 'mpu925'; expected mpu9250"):
        shown("mpu925")
    with pytest.raises(InputError, match="no list of 'disks'; expected one of discs, parts"):
        listed("disks")
