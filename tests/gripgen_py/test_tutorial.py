"""The tutorial runs as it stands, page and notebook are one, and the corrected twin makes the network better."""

import json
import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE, NOTEBOOK = ROOT / "docs/tutorial.md", ROOT / "examples/tutorial.ipynb"


def cells_of_page():
    """Text and code in turn, as the cells of a notebook."""
    cells, at = [], 0
    text = PAGE.read_text()
    for block in re.finditer(r"^```python\n(.*?)^```\n", text, re.M | re.S):
        cells += [("markdown", text[at : block.start()].strip()), ("code", block[1].strip())]
        at = block.end()
    cells.append(("markdown", text[at:].strip()))
    # Links of the page are relative to docs/, the notebook lies in examples/.
    return [(kind, re.sub(r"\]\((\w+\.md)", r"](../docs/\1", source) if kind == "markdown" else source) for kind, source in cells]


def notebook():
    cells = [
        {"cell_type": kind, "id": f"cell-{i}", "metadata": {}, "source": source.splitlines(keepends=True)}
        | ({"execution_count": None, "outputs": []} if kind == "code" else {})
        for i, (kind, source) in enumerate(cells_of_page())
    ]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1, ensure_ascii=False) + "\n"


def test_the_notebook_is_the_page():
    if os.environ.get("GRIPGEN_WRITE"):
        NOTEBOOK.write_text(notebook())
    assert NOTEBOOK.read_text() == notebook(), "GRIPGEN_WRITE=1 writes it anew"


def test_the_notebook_runs_and_the_corrected_twin_helps(tmp_path, monkeypatch):
    pytest.importorskip("gripgen")
    monkeypatch.chdir(tmp_path)
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "gripgen").symlink_to(os.environ["GRIPGEN_BIN"])
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    names = {"__name__": "tutorial"}
    for cell in json.loads(NOTEBOOK.read_text())["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), str(NOTEBOOK), "exec"), names)
    # What was put in is what is found, or is among the causes that these pulls cannot tell apart.
    effects = names["found"].effects
    assert names["found"].verdict == "effect" and "load_offset" in effects[0]["class"], effects
    assert names["found"].error["after"]["rmse_n"] < 0.5 * names["found"].error["before"]["rmse_n"]
    assert names["after_n"] < 0.6 * names["before_n"]
