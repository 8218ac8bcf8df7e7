"""Notebooks as pages of the site: their text, their code, and what they showed when they were stored."""

from __future__ import annotations

import json
from typing import Any

from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx


class NotebookParser(MystParser):
    """A notebook is read as the Markdown of its cells."""

    supported = ("notebook",)

    def parse(self, inputstring: str, document: Any) -> None:
        """Read one."""
        super().parse(markdown(json.loads(inputstring)), document)


def markdown(notebook: dict[str, Any]) -> str:
    """Cells one after another; of what code shows, pictures and texts."""
    parts = []
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
        for shown in cell.get("outputs", ()):
            data = shown.get("data", {})
            if "image/png" in data:
                picture = "".join(data["image/png"]).replace("\n", "")
                parts.append(f'<img alt="what the cell draws" src="data:image/png;base64,{picture}">')
            elif told := "".join(shown.get("text", data.get("text/plain", ""))).rstrip():
                parts.append(f"```text\n{told}\n```")
    return "\n\n".join(parts) + "\n"


def setup(app: Sphinx) -> dict[str, Any]:
    """Tell Sphinx."""
    app.add_source_suffix(".ipynb", "notebook")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
