"""Terms in reports lead to their lines of the glossary on the same page."""

from __future__ import annotations

from discsim.validation.reporting.glossary import glossary, with_terms


def page(body: str) -> str:
    return f"<html><body>\n{body}\n<footer>made by hand</footer></body></html>"


def test_the_glossary_is_that_of_the_documentation_without_the_words_of_old_reports():
    names = {name for term in glossary() for name in term.names}
    assert {"C_Nr", "yaw damping derivative", "detection limit", "effect"} <= names
    assert not names & {"V", "B", "pieces", "term"}
    (effect,) = (term for term in glossary() if "effect" in term.names)
    assert "](" not in effect.meaning


def test_a_term_is_linked_where_it_is_first_used_and_told_above_the_footer():
    found = with_terms(page("<p>C_Nr of two recordings; their recordings, and x_C_Nr.</p>"))
    assert found.count('<a class="term" href="#term-c_nr">C_Nr</a>') == 1
    assert '<a class="term" href="#term-recording">recordings</a>;' in found
    assert found.count('href="#term-recording"') == 1
    assert found.index('<dt id="term-c_nr">C_Nr, yaw damping derivative</dt>') < found.index("<footer>")
    assert 'id="term-residual"' not in found


def test_what_is_no_running_text_stays_as_it_is():
    text = page('<p title="residual"><code>C_Nr</code> <a href="#x">effect</a></p><script>"residual"</script>')
    assert with_terms(text) == text
