"""The tree of architecture.md: every folder and file of the code, with the first sentence of its docstring.

``python docs/tree.py`` writes it anew; ``tests/test_architecture.py`` compares.
"""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "architecture.md"
BLOCK = re.compile(r"(?<=<!-- tree -->\n```\n).*?(?=```\n<!-- end -->)", re.DOTALL)


def tree() -> str:
    """Return the lines of all folders of code."""
    return "".join(_folder(ROOT / name, 0) for name in ("cli", "formats", "pipelines"))


def _folder(path: Path, depth: int) -> str:
    own = _line(f"{path.name}/", _said(path / "__init__.py"), depth)
    files = [_line(file.name, _said(file), depth + 1) for file in sorted(path.glob("*.py")) if file.stem != "__init__"]
    folders = [_folder(folder.parent, depth + 1) for folder in sorted(path.glob("*/__init__.py"))]
    return own + "".join(files) + "".join(folders)


def _line(name: str, text: str, depth: int) -> str:
    return f"{'  ' * depth + name:<26}  {text}\n"


def _said(path: Path) -> str:
    """Return the first sentence of a file's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text())) or ""
    paragraph = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=\w\w[\w)`]\.) ", paragraph)[0].replace("``", "").rstrip(".,: ")


if __name__ == "__main__":
    PAGE.write_text(BLOCK.sub(lambda _: tree(), PAGE.read_text()))
