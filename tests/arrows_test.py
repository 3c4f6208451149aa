#!/usr/bin/env python3
"""The law of arrows: which directory may include what, and a few rules of the house that a text search can hold.

arrows_test.py [ROOT]       checks a source tree (default: the one this file lies in); prints what is wrong, exits 1
arrows_test.py --self-test  shows on a temporary tree that each rule catches its violation
"""

import os
import re
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

# Who may include whom. "btfc" is the public interface, decoder/include/btfc.
ARROWS = {
    "shaders": {"shaders"},
    "format": {"format", "shaders"},
    "btfc": {"btfc"},
    "decoder": {"decoder", "btfc", "format", "shaders"},
    "encoder": {"encoder", "format", "shaders"},
    "tools": {"tools", "encoder", "decoder", "btfc", "format", "shaders"},
}
# Libraries beside the standard one, for what ends up inside the decoder library; the others may use any.
LIBRARIES = {
    "shaders": r"glm/.*",
    "format": r"(fmt|glm|hwy)/.*|zstd\.h|xxhash\.h",
    "btfc": r"std(def|int)\.h",
    "decoder": r"(fmt|glm|hwy)/.*|zstd\.h|xxhash\.h|btfc_general_spirv\.h",  # the last one is made of shaders/
}
BANNED = {"format": {"iostream"}, "decoder": {"iostream"}, "btfc": {"iostream"}, "shaders": {"iostream"}}
NO_THROW = {"format", "decoder", "btfc"}
SOURCES = {".h", ".hpp", ".c", ".cpp", ".comp", ".glsl"}
# Every layer has its own table of models, under the same name so that it is found.
NAMED_ALIKE = re.compile(r"CMakeLists\.txt|README\.md|main\.\w+|model_table\.\w+")
SKIPPED = {"build", "vectors", "__pycache__"}  # vectors: test data, named alike for all models


def files_of(root):
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith("."))
        yield from (Path(folder, name).relative_to(root) for name in sorted(names) if not name.startswith("."))


def layer_of(path):
    return "btfc" if path.parts[:3] == ("decoder", "include", "btfc") else path.parts[0]


def without_comments(text):
    """Code alone: comments become blanks and literals empty, line numbers stay."""
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])+\''
    return re.sub(pattern, lambda m: ('""' if m[0][0] == '"' else " ") + "\n" * m[0].count("\n"), text, flags=re.S)


def included_file(root, path, name, quoted):
    """The file of this tree that an include names, if it does."""
    bases = ([root / path.parent] if quoted else []) + [root, root / "decoder/include", root / "shaders"]
    for base in bases:
        if (base / name).is_file():
            return Path(os.path.relpath(os.path.realpath(base / name), os.path.realpath(root)))
    return None


def check_source(root, path, wrong):
    layer, text = layer_of(path), (root / path).read_text(encoding="utf-8", errors="replace")

    def say(position, message):
        wrong.append(f"{path}:{text.count(chr(10), 0, position) + 1}: {message}")

    if layer in ARROWS:
        for match in re.finditer(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"\n]+)[>"]', text, re.M):
            name, quoted = match[2], match[1] == '"'
            target = included_file(root, path, name, quoted)
            if target is not None:
                if layer_of(target) not in ARROWS[layer]:
                    say(match.start(), f"{layer} must not include {layer_of(target)} ({name})")
            elif quoted:
                say(match.start(), f'"{name}" is not in this tree')
            elif name in BANNED.get(layer, ()):
                say(match.start(), f"{layer} must not include <{name}>")
            elif layer in LIBRARIES and not re.fullmatch(rf"[a-z0-9_]+|{LIBRARIES[layer]}", name):
                say(match.start(), f"{layer} must not depend on <{name}>")

    code = without_comments(text)

    def say_code(position, message):
        wrong.append(f"{path}:{code.count(chr(10), 0, position) + 1}: {message}")

    if layer in NO_THROW:
        for match in re.finditer(r"\bthrow\b", code):
            say_code(match.start(), f"{layer} must not throw")
    if path.stem != "model_table":
        for match in re.finditer(r"\bswitch\s*\([^{;]*\bmodel(_?id)?\b[^{;]*\{|\bcase\s+(\w+::)*ModelId::", code, re.I):
            say_code(match.start(), "a choice by model outside a model table")


def check(root):
    wrong, places = [], defaultdict(list)
    for path in files_of(root):
        if not NAMED_ALIKE.fullmatch(path.name):
            places[path.name].append(str(path))
        if len(path.parts) > 1 and path.suffix in SOURCES:
            check_source(root, path, wrong)
    wrong += [f"{', '.join(paths)}: file names are unique across the tree" for paths in places.values() if len(paths) > 1]
    return wrong


GOOD = {
    "shaders/sum.h": "#ifdef __cplusplus\n#include <glm/glm.hpp>\n#include <cstdint>\n#endif\n",
    "shaders/models/one.h": '#include "../sum.h"\n',
    "format/bytes.h": '// never throws; #include <iostream> stays out\n#include <vector>\n#include "shaders/sum.h"\n',
    "format/model_table.cpp": "switch (model) { case ModelId::one: break; }\n",
    "decoder/model_table.cpp": "switch (model) { case ModelId::one: break; }\n",
    "decoder/include/btfc/btfc.h": "#include <stdint.h>\n",
    "decoder/api.cpp": '#include <new>\n#include "btfc/btfc.h"\n#include "format/bytes.h"\nvoid f() { g("throw"); }\n',
    "encoder/fit.cpp": '#include <OpenImageIO/imageio.h>\n#include "format/bytes.h"\nvoid f() { throw 1; }\n',
    "tools/main.cpp": '#include <iostream>\n#include "encoder/fit.cpp"\n#include <btfc/btfc.h>\n',
    "tests/main.cpp": '#include "tools/main.cpp"\n',
    "tests/vectors/one/bytes.h": "",
    "build/bytes.h": "",
}
# file, text, what must be said; every file is added to the good tree alone
BAD = [
    ("shaders/x.h", '#include "format/bytes.h"\n', "shaders must not include format"),
    ("shaders/x.h", "#include <zstd.h>\n", "must not depend"),
    ("format/x.cpp", '#include "encoder/fit.cpp"\n', "format must not include encoder"),
    ("format/x.cpp", '  # include "../decoder/api.cpp"\n', "format must not include decoder"),
    ("format/x.cpp", "#include <btfc/btfc.h>\n", "format must not include btfc"),
    ("format/x.cpp", "#include <iostream>\n", "must not include <iostream>"),
    ("format/x.cpp", "/* a\n */ void f() { throw 1; }\n", "x.cpp:2: format must not throw"),
    ("decoder/x.cpp", '#include "encoder/fit.cpp"\n', "decoder must not include encoder"),
    ("decoder/x.cpp", '#include "tools/main.cpp"\n', "decoder must not include tools"),
    ("decoder/x.cpp", "#include <iostream>\n", "must not include <iostream>"),
    ("decoder/x.cpp", "#include <OpenImageIO/imageio.h>\n", "must not depend"),
    ("decoder/x.cpp", "#include <CLI/CLI.hpp>\n", "must not depend"),
    ("decoder/x.cpp", "#include <nlohmann/json.hpp>\n", "must not depend"),
    ("decoder/x.cpp", "void f() { throw 1; }\n", "decoder must not throw"),
    ("decoder/include/btfc/x.h", '#include "format/bytes.h"\n', "btfc must not include format"),
    ("encoder/x.cpp", '#include "decoder/api.cpp"\n', "encoder must not include decoder"),
    ("encoder/x.cpp", '#include "btfc/btfc.h"\n', "encoder must not include btfc"),
    ("tools/x.cpp", '#include "tests/main.cpp"\n', "tools must not include tests"),
    ("tools/x.cpp", '#include "nowhere.h"\n', "not in this tree"),
    ("tools/x.cpp", "switch (file.head().model) { }\n", "choice by model"),
    ("tests/x.cpp", "switch (x) {\n case btfc::ModelId::one: break; }\n", "x.cpp:2: a choice by model"),
    ("encoder/bytes.h", "", "unique"),
]


def self_test():
    def wrong_with(extra):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in {**GOOD, **extra}.items():
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            return check(Path(folder))

    failures = [f"good tree: {line}" for line in wrong_with({})]
    for name, text, expected in BAD:
        said = wrong_with({name: text})
        if len(said) != 1 or expected not in said[0]:
            failures.append(f"{name} {text!r}: expected one line with {expected!r}, got {said}")
    return failures


def main():
    if sys.argv[1:] == ["--self-test"]:
        wrong = self_test()
    elif len(sys.argv) <= 2 and not sys.argv[-1].startswith("-"):
        root = Path(sys.argv[1] if len(sys.argv) == 2 else Path(__file__).parent.parent)
        if not (root / "format").is_dir():
            sys.exit(f"{root} is no source tree of btfc")
        wrong = check(root)
    else:
        print(__doc__, file=sys.stderr)
        return 2
    for line in wrong:
        print(line)
    print("arrows:", f"{len(wrong)} wrong" if wrong else "good")
    return 1 if wrong else 0


sys.exit(main())
