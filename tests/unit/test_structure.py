"""The shape of the code: few parameters, short functions and modules, one meaning per name."""

import ast
from collections import defaultdict
from pathlib import Path

import anisomesh

PACKAGE = Path(anisomesh.__file__).parent
MODULES = {
    path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(PACKAGE.rglob("*.py"))
    if "_kernels" not in path.parts
}
COMMANDS = ("cli/",)  # an option of the command line is a parameter of its function


def functions():
    for module, tree in MODULES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                yield module, node


def parameters(node):
    arguments = node.args
    names = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
    extra = (arguments.vararg is not None) + (arguments.kwarg is not None)
    return len([name for name in names if name not in ("self", "cls")]) + extra


def test_few_functions_have_more_than_six_parameters():
    many = [
        (parameters(node), module, node.name)
        for module, node in functions()
        if parameters(node) > 6 and not module.startswith(COMMANDS)
    ]
    assert len(many) <= 5, many
    assert all(count <= 8 for count, _, _ in many), many


def test_functions_and_packages_are_short():
    lengths = sorted(node.end_lineno - node.lineno + 1 for _, node in functions())
    assert lengths[int(0.9 * len(lengths))] <= 40
    sizes = defaultdict(int)
    for path in PACKAGE.rglob("*.py"):
        if "_kernels" not in path.parts:
            sizes[path.parent] += path.read_text(encoding="utf-8").count("\n")
    assert max(sizes.values()) < 2_000


def test_a_constant_or_class_has_one_home():
    homes = defaultdict(set)
    for module, tree in MODULES.items():
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            names = [target.id for target in targets if isinstance(target, ast.Name)]
            names = [name for name in names if name.strip("_").isupper() and len(name.strip("_")) > 1]
            for name in [*names, *([node.name] if isinstance(node, ast.ClassDef) else [])]:
                homes[name].add(module)
    assert {name: places for name, places in homes.items() if len(places) > 1} == {}


def test_public_functions_and_classes_are_documented():
    bare = []
    for module, tree in MODULES.items():
        bare += [] if ast.get_docstring(tree) else [module]
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                members = node.body if isinstance(node, ast.ClassDef) else []
                public = [m for m in members if isinstance(m, ast.FunctionDef) and not m.name.startswith("_")]
                bare += [f"{module}: {n.name}" for n in [node, *public] if not ast.get_docstring(n)]
    assert [name for name in bare if "forward" not in name and "backward" not in name] == []
