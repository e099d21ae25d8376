"""No cycle between source files, read from their own imports."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]

PACKAGES = [
    "crates/twin/src", "crates/physics/src", "crates/tactile/src", "crates/identify/src", "crates/record/src",
    "crates/measured/src", "crates/report/src", "crates/rig/src", "crates/rig_sim/src", "crates/cli/src", "crates/py/src", "src",
]

DEFINITION = re.compile(r"\b(?:fn|struct|enum|trait|const|type|static|macro_rules!)\s+([A-Za-z_]\w*)")
USE = re.compile(r"\b(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
PATH = re.compile(r"\b(?:crate|super)(?:::\w+)+")


def end_of(text, word, start):
    """Where `word` stands from `start` on; the end of the text if it does not."""
    at = text.find(word, start)
    return len(text) if at < 0 else at


def item_end(text, start):
    """End of the item at `start`: its `;` or its closing brace, outside strings and comments."""
    depth, i = 0, start
    while i < len(text):
        c = text[i]
        if text.startswith("//", i):
            i = end_of(text, "\n", i)
        elif text.startswith('r#"', i):
            i = end_of(text, '"#', i + 3)
        elif c == '"':
            i += 1
            while i < len(text) and text[i] != '"':
                i += 2 if text[i] == "\\" else 1
        elif text.startswith("'\\", i):
            i = end_of(text, "'", i + 3)
        elif c == "'" and text[i + 2:i + 3] == "'":
            i += 2
        elif c in "{([":
            depth += 1
        elif c in "})]":
            if depth == 0:
                return i
            depth -= 1
            if c == "}" and depth == 0:
                return i + 1
        elif c == ";" and depth == 0:
            return i + 1
        i += 1
    return len(text)


def source(path):
    """A file without comments and without what is compiled for tests only."""
    text = path.read_text(encoding="utf-8")
    while (at := text.find("#[cfg(test)]")) >= 0:
        text = text[:at] + text[item_end(text, at):]
    return re.sub(r"//[^\n]*", "", text)


def expanded(tree, prefix=""):
    """Paths of a `use` tree."""
    tree = re.sub(r"\s+", "", re.sub(r"\s+as\s+\w+", "", tree))
    brace = tree.find("{")
    if brace < 0:
        return [[part for part in (prefix + tree).split("::") if part]]
    paths, depth, start = [], 0, brace + 1
    body = tree[:tree.rindex("}")] + ","
    for i in range(brace + 1, len(body)):
        depth += (body[i] == "{") - (body[i] == "}")
        if body[i] == "," and depth == 0:
            if body[start:i]:
                paths += expanded(body[start:i], prefix + tree[:brace])
            start = i + 1
    return paths


class Package:
    def __init__(self, folder):
        self.files = {}
        for path in sorted(folder.rglob("*.rs")):
            name = path.relative_to(folder).with_suffix("").parts
            is_test = name[-1].endswith("tests") or "tests" in name or name[-1] == "testing"
            if not is_test and name != ("main",):
                self.files[() if name == ("lib",) else name] = source(path)
        self.defined = {name: set(DEFINITION.findall(text)) for name, text in self.files.items()}
        self.uses = {
            name: [(bool(m.group(1)), path) for m in USE.finditer(text) for path in expanded(m.group(2))]
            for name, text in self.files.items()
        }

    def home(self, file, path, seen=()):
        """The file that defines what `path` names in `file`, through re-exports; `None` outside the package."""
        at, rest = file, list(path)
        if rest[0] == "crate":
            at, rest = (), rest[1:]
        elif rest[0] == "self":
            rest = rest[1:]
        elif rest[0] == "super":
            while rest and rest[0] == "super":
                at, rest = at[:-1], rest[1:]
        elif (*at, rest[0]) not in self.files and rest[0] not in self.defined[at]:
            return None
        while rest and (*at, rest[0]) in self.files:
            at, rest = (*at, rest[0]), rest[1:]
        if at not in self.files or not rest or rest[0] in ("*", "self") or rest[0] in self.defined[at]:
            return at if at in self.files else None
        if (at, rest[0]) in seen:
            return None
        for _, known in self.uses[at]:
            if known[-1] in (rest[0], "*"):
                found = self.home(at, [*known[:-1], *rest], (*seen, (at, rest[0])))
                if found is not None:
                    return found
        return at

    def needs(self, file):
        """Files that `file` takes something from; what it only passes on does not count."""
        own = [path for passed_on, path in self.uses[file] if not passed_on]
        own += [m.group().split("::") for m in PATH.finditer(USE.sub("", self.files[file]))]
        homes = {self.home(file, path) for path in own}
        children = [name for name in self.files if name[:-1] == file and name]
        body = USE.sub("", self.files[file])
        homes |= {name for name in children if re.search(rf"(?<![\w:]){name[-1]}::\w", body)}
        return {home for home in homes if home is not None} - {file}


def cycles(edges):
    """Strongly connected components of more than one file (Tarjan 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(v):
        index[v] = low[v] = len(index)
        stack.append(v)
        for w in edges[v]:
            if w not in index:
                visit(w)
                low[v] = min(low[v], low[w])
            elif w in stack:
                low[v] = min(low[v], index[w])
        if low[v] == index[v]:
            group = []
            while group[-1:] != [v]:
                group.append(stack.pop())
            if len(group) > 1:
                found.append(group)

    for v in edges:
        if v not in index:
            visit(v)
    return found


def one_room(group):
    """Whether a group is a file with files of the folder of its name."""
    head = min(group, key=len)
    return all(name[:len(head)] == head for name in group)


def test_the_reader_follows_reexports_and_leaves_tests_out():
    assert expanded("crate::{a::{B, C as D}, e::*}") == [["crate", "a", "B"], ["crate", "a", "C"], ["crate", "e", "*"]]
    text = '#[cfg(test)]\nmod tests { fn f() { "}" } }\nfn g() {}'
    assert text[item_end(text, 0):] == "\nfn g() {}"
    assert item_end("#[cfg(test)]\nmod t { // x", 0) == 25, "a comment that nothing ends"
    assert item_end('#[cfg(test)] field: u8 }', 0) == 23, "a field ends where its struct does"
    physics = Package(ROOT / "crates/physics/src")
    assert physics.home(("grip",), ["crate", "arm", "PlacedArm"]) == ("arm", "placed")
    assert ("setup",) in physics.needs(("scene",))
    assert cycles({1: {2}, 2: {3}, 3: {2}, 4: {1}}) == [[3, 2]]


def test_no_two_files_need_each_other():
    wrong = []
    for folder in PACKAGES:
        package = Package(ROOT / folder)
        # The root of a package names everything.
        edges = {name: sorted(package.needs(name) - {()}) for name in package.files if name}
        groups = [sorted("/".join(name) for name in group) for group in cycles(edges) if not one_room(group)]
        wrong += [f"{folder}: {', '.join(group)}" for group in groups]
    assert not wrong, wrong
