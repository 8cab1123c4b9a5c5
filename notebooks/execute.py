"""Run every notebook in this folder and keep what it showed.

    python notebooks/execute.py [FOLDER FOR THE RESULTS]

Without a folder the notebooks are written in place. Execution times and kernel details are left
out, so that a notebook that shows the same again is the same file.
"""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent


def execute(source: Path, target: Path) -> None:
    """Run one notebook in the folder it lies in, and write it with its outputs."""
    notebook = nbformat.read(source, as_version=4)
    client = NotebookClient(
        notebook,
        timeout=300,
        resources={"metadata": {"path": str(HERE)}},
        # How a cell's prints arrive depends on timing; joined they are the same each time.
        coalesce_streams=True,
    )
    client.execute()
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}
    }
    for cell in notebook.cells:
        cell.metadata = {}
    nbformat.write(notebook, target)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    for source in sorted(HERE.glob("*.ipynb")):
        execute(source, folder / source.name)
        print(f"{source.name} done")


if __name__ == "__main__":
    main()
