"""Count what the structure of the code is judged by; run as `python tests/count_structure.py`."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: classes of results, of their data and of studies without a file
KINDS = {
    *("Result", "DissipationResult", "EnsembleResult", "IdentificationResult", "LifeResult"),
    *("RunData", "DissipationData", "EnsembleData", "IdentificationData"),
    *("ContactStudy", "CamStudy", "Comparison", "Compared"),
}
#: names by which code asks whether a body is a cam or a cylinder
CAMS = {
    *("cam", "is_cam", "has_cam", "along_cam"),
    *("OneStation", "CamStations", "CylinderTurn", "CamTurn"),
}
#: what shows results: the verbs, the renderers, and the views of every kind
PRESENTATION = re.compile(
    r"wearsim/(cli/(commands|render)/|report/|cli/(render|solver_state)\.py|scenario/display\.py"
    r"|results/(csv_export|tables|study_view|viewed)\.py|studies/(.*/)?(\w*view|panels|rows)\.py)"
)


def statements(tree: ast.AST) -> int:
    """Return the number of statements below a node, without docstrings."""
    return sum(
        isinstance(node, ast.stmt)
        and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        for node in ast.walk(tree)
    )


def asks_for_a_kind(node: ast.AST) -> bool:
    """Return whether a node is a call of isinstance with a kind of result or study."""
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
        return False
    names = {item.id for item in ast.walk(node) if isinstance(item, ast.Name)}
    return node.func.id == "isinstance" and bool(names & KINDS)


def tests_in(node: ast.AST) -> list[ast.expr]:
    """Return the conditions of a node: of a branch or a loop, or operands of `and` and `or`."""
    if isinstance(node, ast.If | ast.IfExp | ast.While | ast.Assert):
        return [node.test]
    if isinstance(node, ast.comprehension):
        return node.ifs
    return [node] if isinstance(node, ast.BoolOp) else []


def branches_on_cams(tree: ast.AST) -> int:
    """Return the number of conditions that ask whether there is a cam, each counted once.

    A condition on an attribute of a cam, such as its groove, is none of them.
    """
    seen: set[int] = set()
    branches = 0
    for node in ast.walk(tree):
        for test in tests_in(node):
            parts = list(ast.walk(test))
            owners = {id(p.value) for p in parts if isinstance(p, ast.Attribute | ast.Subscript)}
            asked = {getattr(p, "id", getattr(p, "attr", "")) for p in parts if id(p) not in owners}
            keys = {p.value for p in parts if isinstance(p, ast.Constant)}
            if id(test) not in seen and (asked & CAMS or "cam" in keys):
                branches += 1
                seen |= {id(part) for part in parts}
    return branches


def counts(root: Path = ROOT) -> dict[str, int]:
    """Return the numbers by what is counted, over all modules of wearsim."""
    texts = {str(p.relative_to(root)): p.read_text() for p in (root / "wearsim").rglob("*.py")}
    trees = {name: ast.parse(text) for name, text in texts.items()}
    shown = {name: tree for name, tree in trees.items() if PRESENTATION.match(name)}
    naming = [name for name, text in texts.items() if re.search(r"\bLifeResult\b", text)]
    home = [name for name in naming if "studies/life/" in name or "ensemble/life" in name]
    return {
        "isinstance on kinds": sum(
            asks_for_a_kind(node) for tree in trees.values() for node in ast.walk(tree)
        ),
        "branches on cams": sum(map(branches_on_cams, trees.values())),
        "files naming LifeResult": len(naming),
        "files outside its folder naming LifeResult": len(naming) - len(home),
        "files of presentation": len(shown),
        "statements of presentation": sum(map(statements, shown.values())),
        "statements of wearsim": sum(map(statements, trees.values())),
    }


if __name__ == "__main__":
    for name, number in counts().items():
        sys.stdout.write(f"{number:8,d}  {name}\n")
