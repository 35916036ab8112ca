"""Pages from templates: prose is wrapped, and nothing else is touched."""

from __future__ import annotations

import pytest
from jinja2 import UndefinedError

from discsim.validation.reporting.markdown import page_text, span, table, wrapped

LONG = "- no entry of a list, however long the line " + 20 * "and on "
CODE = f"```sh\ndiscsim study   paper\n\n{LONG}\n```"
KEPT = [CODE, "# A heading", "| a |\n| --- |\n| b |", "![a picture](b.png)", '<a id="x"></a>']


def test_prose_is_wrapped_and_entries_of_a_list_hang():
    text = wrapped(f"One\nparagraph{30 * ' of words'}.\n\n- first\n  entry\n- second{30 * ' of words'}\n")
    first, second = text.rstrip("\n").split("\n\n")
    assert max(map(len, text.splitlines())) <= 118
    assert first.startswith("One paragraph of words")
    entries = second.splitlines()
    assert entries[:1] == ["- first entry"]
    assert entries[1].startswith("- second")
    assert entries[2].startswith("  of words")


@pytest.mark.parametrize("block", KEPT)
def test_code_headings_tables_pictures_and_tags_stay_as_they_are(block):
    assert wrapped(f"before\n\n\n{block}\n\nafter") == f"before\n\n{block}\n\nafter\n"


def test_a_cell_stays_in_its_column_and_on_its_line():
    assert table(("a",), [("|x| on\ntwo lines",)]) == "| a |\n| --- |\n| \\|x\\| on two lines |"


def test_a_span_of_one_reading_is_one_number():
    assert span([1.04, 0.96], ".1f") == "1.0"
    assert span([1.04, 0.9], ".1f", 10.0) == "9.0 to 10.4"


def test_what_a_template_asks_for_and_is_not_given_is_an_error(tmp_path):
    template = tmp_path / "page.md.j2"
    template.write_text("{{ rate | degrees | f('.1f') }} deg/s\n")
    assert page_text(template, rate=3.141592653589793) == "180.0 deg/s\n"
    with pytest.raises(UndefinedError, match="rate"):
        page_text(template)
