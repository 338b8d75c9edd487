"""examples/quickstart.ipynb runs from top to bottom, and shows what its texts promise."""

import re
import sys
from pathlib import Path

import nbformat
import pytest
from jupyter_client import KernelManager
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[3] / "examples" / "quickstart.ipynb"
LIMIT = 600  # [s] for a cell

pytestmark = pytest.mark.slow


def test_it_leads_from_an_environment_to_films(tmp_path: Path) -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # the file holds none
    manager = KernelManager()
    manager.kernel_spec.argv[0] = sys.executable
    resources = {"metadata": {"path": tmp_path}}
    NotebookClient(notebook, km=manager, timeout=LIMIT, resources=resources).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    texts = ["".join(each.get("text", "") for each in cell.outputs) for cell in cells]
    mean = next(float(found[1]) for text in texts if (found := re.search(r"mean ([\d.]+)", text)))
    assert mean > 475
    images = {kind for cell in cells for each in cell.outputs for kind in each.get("data", {})}
    assert {"image/png", "image/gif"} <= images
