"""Tables in Markdown have one form."""

from drake_navbench.markdown_text import markdown_table


def test_columns_are_aligned_by_their_letters_and_bars_escaped():
    assert markdown_table(("a", "b", "c"), [("x|y", " 1", "2")], "lr") == [
        "| a | b | c |",
        "|---|---:|---|",
        "| x\\|y | 1 | 2 |",
    ]
