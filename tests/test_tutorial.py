"""The tutorial in docs/ runs from top to bottom, in a folder of its own."""

from pathlib import Path

import pytest

TUTORIAL = Path(__file__).parents[1] / "docs" / "tutorial.ipynb"
KIBIBYTE = 2**10


def test_the_tutorial_is_kept_as_it_ran():
    import nbformat

    notebook = nbformat.read(TUTORIAL, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) >= 5
    for cell in code:
        assert cell.outputs
        assert all(output.output_type == "execute_result" for output in cell.outputs)
    assert TUTORIAL.stat().st_size < 500 * KIBIBYTE


@pytest.mark.long
def test_the_tutorial_runs_and_shows_what_it_shows(tmp_path):
    import nbformat
    from nbclient import NotebookClient

    kept = nbformat.read(TUTORIAL, as_version=4)
    again = nbformat.read(TUTORIAL, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(again, timeout=None, kernel_name="python3", resources=resources).execute()
    assert list(tmp_path.iterdir()) == []
    for before, now in zip(kept.cells, again.cells, strict=True):
        shown = [o for o in now.get("outputs", ()) if o.output_type == "execute_result"]
        assert len(shown) == len(before.get("outputs", ()))
