"""The notebook of the documentation runs, and its outputs are drawings."""

import shutil
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The data of all outputs, in order, by media type."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # those of Jupyter's packages are not ours
        import nbclient
        import nbformat

        folder = tmp_path_factory.mktemp("notebook")
        shutil.copytree(ROOT / "scenarios", folder / "scenarios")
        (folder / "docs").mkdir()
        notebook = nbformat.read(ROOT / "docs" / "notebook.ipynb", as_version=4)
        client = nbclient.NotebookClient(
            notebook, timeout=300, resources={"metadata": {"path": str(folder / "docs")}}
        )
        client.execute()
    return [o["data"] for c in notebook.cells for o in c.get("outputs", []) if "data" in o]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_scenario_and_a_run_draw_themselves(outputs: list[dict[str, Any]]) -> None:
    (drawing,) = [data["image/svg+xml"] for data in outputs if "image/svg+xml" in data]
    assert ElementTree.fromstring(drawing).tag.endswith("svg")
    result, page = [data["text/html"] for data in outputs if "text/html" in data]
    assert "<th>outcome</th><td>completed</td>" in result
    assert page.startswith("<iframe srcdoc=")
    assert "requests help with door@47" in outputs[-1]["text/plain"]


def test_the_committed_notebook_holds_no_outputs() -> None:
    import json

    cells = json.loads((ROOT / "docs" / "notebook.ipynb").read_text())["cells"]
    assert not [cell for cell in cells if cell.get("outputs")]
