"""A small interpreter of SPIR-V that counts what a compute shader executes, for cost_test.py.

A module is turned into Python once: a function a function, its structured control flow kept. Every basic block counts how
often it ran, and what a block holds is known beforehand, so counting costs little. Numbers are those of the shader:
binary32 rounded to nearest after each operation, integers of 32 bits.

Enough for what glslang makes of GLSL compute shaders without an optimiser: scalars of 32 bits, vectors, arrays, structs,
no matrices, no 16- or 64-bit types, no atomics, no barriers, descriptor set 0. What is not known raises NotImplementedError.

What is counted, each per component:
  float      FAdd FSub FMul FDiv FNegate FRem FMod, VectorTimesScalar, Dot (2 n - 1), and of GLSL.std.450 one for each of
             FAbs FSign Floor Ceil Fract Sqrt InverseSqrt FMin FMax and two for each of FClamp and Fma, three for FMix
  integer    arithmetic, shifts, bit operations, integer minima and maxima
  compare    comparisons, logical operations, Select
  convert    between floats and integers; bit casts are nothing
  read       words of 32 bits loaded from storage buffers, by binding: ("read", binding)
  uniform    words loaded from uniform blocks and push constants
  image      image reads and writes
Loads and stores of variables, branches, and moving components about are no operations.
"""

import array
import math
import struct
from collections import Counter

MASK, SIGN = 0xFFFFFFFF, 0x80000000

# ---- numbers

_word = bytearray(4)
_as_uint, _as_float = memoryview(_word).cast("I"), memoryview(_word).cast("f")


def float_of(word):
    """Bits as binary32."""
    _as_uint[0] = word
    return _as_float[0]


def word_of(number):
    """A number rounded to binary32, as bits."""
    return struct.unpack("<I", struct.pack("<f", number))[0]


def rounded(number):
    return struct.unpack("<f", struct.pack("<f", number))[0]


def _signed(word):
    return (word ^ SIGN) - SIGN


def _divided(a, b):
    """In binary64; a double's quotient, product, sum and root round to those of floats (53 >= 2 * 24 + 2)."""
    if b:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _root(a):
    return math.sqrt(a) if a >= 0 else math.nan


def _whole(a):
    return int(a) & MASK if math.isfinite(a) else 0


def _toward_zero(a, b):
    q = abs(a) // abs(b)
    return q if (a < 0) == (b < 0) else -q


HELPERS = {"math": math, "R": array.array("f", [0.0]), "D": _divided, "Q": _root, "W": _whole, "S": _signed,
           "I": _as_uint, "F": _as_float, "Z": _toward_zero}

# ---- instructions: opcode -> (expression of operands, what it counts as, whether the result is rounded)

FLOAT = {127: "-{0}", 129: "{0}+{1}", 131: "{0}-{1}", 133: "{0}*{1}", 136: "D({0},{1})", 140: "math.fmod({0},{1})",
         141: "{0}-{1}*math.floor({0}/{1})"}
INTEGER = {126: "-{0}&0xffffffff", 128: "({0}+{1})&0xffffffff", 130: "({0}-{1})&0xffffffff",
           132: "({0}*{1})&0xffffffff", 134: "{0}//{1}", 135: "Z(S({0}),S({1}))&0xffffffff", 137: "{0}%{1}",
           138: "int(math.fmod(S({0}),S({1})))&0xffffffff", 139: "S({0})%S({1})&0xffffffff",
           194: "{0}>>({1}&31)", 195: "(S({0})>>({1}&31))&0xffffffff", 196: "({0}<<({1}&31))&0xffffffff",
           197: "{0}|{1}", 198: "{0}^{1}", 199: "{0}&{1}", 200: "{0}^0xffffffff",
           203: "({0}>>{1})&((1<<{2})-1)", 205: "bin({0}).count('1')"}
COMPARE = {156: "{0}!={0}", 157: "abs({0})==math.inf", 164: "{0}=={1}", 165: "{0}!={1}", 166: "{0} or {1}",
           167: "{0} and {1}", 168: "not {0}", 170: "{0}=={1}", 171: "{0}!={1}", 172: "{0}>{1}", 174: "{0}>={1}",
           176: "{0}<{1}", 178: "{0}<={1}", 173: "S({0})>S({1})", 175: "S({0})>=S({1})", 177: "S({0})<S({1})",
           179: "S({0})<=S({1})", 180: "{0}=={1}", 182: "({0}<{1} or {0}>{1})", 183: "{0}!={1}", 184: "{0}<{1}",
           186: "{0}>{1}", 188: "{0}<={1}", 190: "{0}>={1}"}
CONVERT = {109: "W({0})", 110: "W({0})", 111: "S({0})", 112: "{0}"}
ROUNDED_CONVERT = {111, 112}
# GLSL.std.450: number -> (expression, category, how many, rounded)
EXTENDED = {4: ("abs({0})", "float", 1, 0), 6: ("(({0}>0)-({0}<0))*1.0", "float", 1, 0),
            8: ("(math.floor({0})*1.0 if abs({0})<2**24 else {0})", "float", 1, 0),
            9: ("(math.ceil({0})*1.0 if abs({0})<2**24 else {0})", "float", 1, 0),
            10: ("{0}-math.floor({0})", "float", 1, 1), 31: ("Q({0})", "float", 1, 1),
            32: ("D(1.0,Q({0}))", "float", 1, 1), 37: ("min({0},{1})", "float", 1, 0),
            38: ("min({0},{1})", "integer", 1, 0), 39: ("min({0},{1},key=S)", "integer", 1, 0),
            40: ("max({0},{1})", "float", 1, 0), 41: ("max({0},{1})", "integer", 1, 0),
            42: ("max({0},{1},key=S)", "integer", 1, 0), 43: ("min(max({0},{1}),{2})", "float", 2, 0),
            44: ("min(max({0},{1}),{2})", "integer", 2, 0), 46: ("{0}*(1.0-{2})+{1}*{2}", "float", 3, 1),
            5: ("abs(S({0}))", "integer", 1, 0),
            50: ("{0}*{1}+{2}", "float", 2, 1)}  # rounds twice where a fused one would be half way; near enough
SKIPPED = {0, 3, 4, 6, 7, 8, 10, 14, 16, 17, 317, 330, 331, 332}  # sources, lines, modes, capabilities, decorations of strings

(UNIFORM_CONSTANT, INPUT, UNIFORM, OUTPUT, WORKGROUP, PRIVATE, FUNCTION, PUSH, STORAGE) = 0, 1, 2, 3, 4, 6, 7, 9, 12
GLOBAL_INVOCATION, WORKGROUP_ID, LOCAL_INVOCATION, LOCAL_INDEX, WORKGROUP_SIZE = 28, 26, 27, 29, 25


class Type:
    def __init__(self, kind, size=1, element=None, members=()):
        self.kind, self.size, self.element, self.members = kind, size, element, members  # size: scalars when flattened

    def at(self, index):
        """Type and first scalar of a member or element that is known."""
        if self.kind == "struct":
            return self.members[index], sum(m.size for m in self.members[:index])
        return self.element, index * self.element.size


class Function:
    def __init__(self, number, result):
        self.number, self.result, self.parameters, self.blocks = number, result, [], {}


class Module:
    """A module as it is in the file; `build` makes a program of it."""

    def __init__(self, data):
        words = struct.unpack(f"<{len(data) // 4}I", data)
        if words[0] != 0x07230203:
            raise ValueError("no SPIR-V")
        self.names, self.decorations, self.member_offsets = {}, {}, {}
        self.globals, self.functions, self.entry = [], {}, None
        at, function, block = 5, None, None
        while at < len(words):
            op, count = words[at] & 0xFFFF, words[at] >> 16
            args = words[at + 1:at + count]
            at += count
            if op == 5:
                self.names[args[0]] = self.text(args[1:])
            elif op == 15:
                self.entry = args[1]
            elif op == 71:
                self.decorations.setdefault(args[0], {})[args[1]] = args[2] if len(args) > 2 else None
            elif op == 72:
                if args[2] == 35:
                    self.member_offsets[args[0], args[1]] = args[3]
                elif args[2] == 11:
                    self.decorations.setdefault((args[0], args[1]), {})[11] = args[3]
            elif op == 54:
                function = self.functions[args[1]] = Function(args[1], args[0])
            elif op == 55:
                function.parameters.append((args[1], args[0]))
            elif op == 56:
                function = None
            elif op == 248:
                block = function.blocks.setdefault(args[0], [])
            elif function:
                if op not in SKIPPED:
                    block.append((op, args))
            elif op not in SKIPPED:
                self.globals.append((op, args))

    @staticmethod
    def text(words):
        return struct.pack(f"<{len(words)}I", *words).split(b"\0")[0].decode()

    def name(self, number):
        """A function's name without its mangled parameters."""
        return self.names.get(number, str(number)).split("(")[0]

    def build(self, specialised=(), apart=()):
        """specialised: words by SpecId. apart: functions whose inside is counted on an account of their own."""
        return Program(self, dict(specialised), tuple(apart))


class Program:
    def __init__(self, module, specialised, apart):
        self.m, self.apart = module, apart
        self.types, self.constants, self.constant_type, self.extended = {}, {}, {}, None
        self.pointers, self.variables = {}, {}
        self.costs, self.entries = [], {}  # of blocks: Counter; first block of each function
        self.env = dict(HELPERS)
        self.env["C"] = self.accounts = {}
        self.env["V"] = self.returned = {}  # of the functions apart, what each call gave
        for op, args in module.globals:
            self.declare(op, args, specialised)
        lines = []
        for function in module.functions.values():
            lines += self.function(function)
        exec(compile("\n".join(lines), "<shader>", "exec"), self.env)  # noqa: the text is ours
        for name in ("", *apart):
            self.accounts[name] = [0] * len(self.costs)

    # ---- types, constants, variables of the module

    def declare(self, op, args, specialised):
        if op == 11:
            self.extended = args[0]
        elif op in (19, 20, 21, 22):
            if op in (21, 22) and args[1] != 32:
                raise NotImplementedError(f"type of {args[1]} bits")
            self.types[args[0]] = Type({19: "void", 20: "bool", 21: "int", 22: "float"}[op], 0 if op == 19 else 1)
        elif op in (23, 28):
            element, n = self.types[args[1]], args[2] if op == 23 else self.constants[args[2]]
            self.types[args[0]] = Type("vector" if op == 23 else "array", n * element.size, element)
        elif op == 29:
            self.types[args[0]] = Type("runtime", 0, self.types[args[1]])
        elif op == 30:
            self.types[args[0]] = Type("struct", sum(self.types[a].size for a in args[1:]), None,
                                       tuple(self.types[a] for a in args[1:]))
        elif op == 25:
            self.types[args[0]] = Type("image", 1, self.types[args[1]])
        elif op == 32:
            self.pointers[args[0]] = (args[1], self.types[args[2]])
        elif op == 33:
            pass
        elif op in (41, 42, 43, 44, 46, 48, 49, 50, 51, 52):
            self.constant(op, args, specialised)
        elif op == 59:
            self.variable(args)
        else:
            raise NotImplementedError(f"instruction {op} outside of functions")
        if op in (23, 28, 29, 30):
            self.types[args[0]].number = args[0]

    def constant(self, op, args, specialised):
        kind, number = self.types[args[0]], args[1]
        given = specialised.get(self.m.decorations.get(number, {}).get(1), None)
        if op in (41, 42, 48, 49):
            value = op in (41, 48) if given is None else bool(given)
        elif op in (43, 50):
            word = args[2] if given is None else given
            value = float_of(word) if kind.kind == "float" else word
        elif op == 46:
            value = self.zero(kind)
        elif op in (44, 51):
            value = ()
            for a in args[2:]:
                part = self.constants[a]
                value += part if isinstance(part, tuple) else (part,)
        else:  # OpSpecConstantOp
            expression, *_ = self.operation(args[2], number, kind, args[3:])
            value = eval(expression, self.env)  # noqa: the text is ours
        self.constants[number], self.constant_type[number] = value, kind

    def zero(self, kind):
        if kind.size == 1 and kind.kind not in ("vector", "array", "struct"):
            return {"float": 0.0, "bool": False}.get(kind.kind, 0)
        return tuple(self.scalars(kind))

    def scalars(self, kind):
        """Zeros of each scalar of a type."""
        if kind.kind == "struct":
            return [z for m in kind.members for z in self.scalars(m)]
        if kind.kind in ("vector", "array"):
            return self.scalars(kind.element) * (kind.size // kind.element.size)
        return [{"float": 0.0, "bool": False}.get(kind.kind, 0)]

    def variable(self, args):
        storage, kind = self.pointers[args[0]]
        number, decorations = args[1], self.m.decorations.get(args[1], {})
        name = f"g{number}"
        if decorations.get(34, 0) != 0:
            raise NotImplementedError("descriptor sets beyond 0")
        if storage == UNIFORM and self.m.decorations.get(kind.number, {}).get(3, 0) is None:
            storage = STORAGE  # BufferBlock of older versions
        self.variables[number] = (storage, kind, decorations.get(33), decorations.get(11))
        if storage in (PRIVATE, WORKGROUP, OUTPUT):
            self.env[name] = self.scalars(kind)
            if len(args) > 3:
                value = self.constants[args[3]]
                self.env[name][:] = value if isinstance(value, tuple) else (value,)

    # ---- functions

    def function(self, function):
        self.f, self.kinds, self.refs, self.lines = function, {}, {}, []
        self.chains = {args[1]: args[2] for body in function.blocks.values() for op, args in body if op in (65, 66)}
        self.local_scalars = self.plain_scalars(function)
        for number, kind in function.parameters:
            if kind in self.pointers:
                self.refs[number] = (FUNCTION, f"t{number}", "0", 0, self.pointers[kind][1])
            else:
                self.kinds[number] = self.types[kind]
        self.phis = {}
        for label, body in function.blocks.items():
            for op, args in body:
                if op == 245:
                    for value, source in zip(args[2::2], args[3::2]):
                        self.phis.setdefault((source, label), []).append((args[1], value))
                    self.kinds[args[1]] = self.types[args[0]]
                elif op not in (59, 65) and len(args) > 1 and args[0] in self.types:
                    self.kinds[args[1]] = self.types[args[0]]
        names = ["N", *(f"t{number}" for number, _ in function.parameters)]
        self.lines.append(f"def f{function.number}({','.join(names)}):")
        first = next(iter(function.blocks))
        self.block_numbers = {}
        self.blocks_from(first, {}, 1)
        self.entries[function.number] = self.block_numbers[first]
        return self.lines

    @staticmethod
    def plain_scalars(function):
        """Variables that are only loaded and stored whole: they become plain names."""
        variables, used_otherwise = set(), set()
        for body in function.blocks.values():
            for op, args in body:
                if op == 59:
                    variables.add(args[1])
                elif op not in (61, 62):
                    used_otherwise.update(args)
        return variables - used_otherwise

    def say(self, indent, text):
        self.lines.append(" " * indent + text)

    def value(self, number):
        if number in self.constants:
            value = self.constants[number]
            if isinstance(value, float) and not math.isfinite(value):
                return f"math.{'nan' if value != value else 'inf' if value > 0 else 'inf*-1'}"
            return f"({value!r})" if not isinstance(value, (bool, int)) else repr(value)
        return f"t{number}"

    def kind(self, number):
        return self.constant_type[number] if number in self.constants else self.kinds[number]

    def blocks_from(self, label, exits, indent):
        """Code of a block and of all that follows; exits: what a branch to a label is, beside going on there."""
        while label is not None:
            label = self.block(label, exits, indent)

    def block(self, label, exits, indent):
        body = self.f.blocks[label]
        cost = Counter()
        if label not in self.block_numbers:
            self.block_numbers[label] = len(self.costs)
            self.costs.append(cost)
        number = self.block_numbers[label]
        merge = next(((op, args) for op, args in body if op in (246, 247)), (0, ()))
        if merge[0] == 246:
            self.say(indent, "while True:")
            outer, indent = (exits, indent), indent + 1
            exits = {merge[1][0]: ("break",), merge[1][1]: ("continue", merge[1][1], label, merge[1][0]), **{
                target: action for target, action in exits.items() if action[0] == "flag"}}
        self.say(indent, f"N[{number}]+=1")
        for op, args in body[:-1]:
            if op not in (245, 246, 247):
                self.instruction(op, args, indent, cost)
        self.costs[number] = cost
        op, args = body[-1]
        after = None
        if op == 249 and not merge[0]:
            return self.go(label, args[0], exits, indent, True)
        if op == 249:
            self.go(label, args[0], exits, indent)
        elif op == 250:
            inside = {**exits, merge[1][0]: ("fall",)} if merge[0] == 247 else exits
            self.say(indent, f"if {self.value(args[0])}:")
            self.go(label, args[1], inside, indent + 1)
            self.say(indent, "else:")
            self.go(label, args[2], inside, indent + 1)
        elif op == 251:
            self.switch(label, args, merge[1][0], exits, indent)
        elif op in (253, 254):
            self.say(indent, "return" if op == 253 else f"return {self.value(args[0])}")
            return None
        elif op == 255:
            self.say(indent, "raise RuntimeError('unreachable')")
            return None
        else:
            raise NotImplementedError(f"instruction {op} at a block's end")
        if merge[0]:
            after = merge[1][0]
        if merge[0] == 246:
            exits, indent = outer
        return after

    def switch(self, label, args, merge, exits, indent):
        """As a loop that runs once, so that leaving it is a break; leaving what is around it takes a flag."""
        flags = {target: ("flag", target) for target, action in exits.items() if action[0] in ("break", "continue", "flag")}
        inside = {**flags, merge: ("break",)}
        if flags:
            self.say(indent, "go=0")
        self.say(indent, "while True:")
        cases = {}
        for literal, target in zip(args[2::2], args[3::2]):
            cases.setdefault(target, []).append(literal)
        word = "if"
        for target, literals in cases.items():
            if target != args[1]:
                self.say(indent + 1, f"{word} {self.value(args[0])} in {tuple(literals)!r}:")
                self.go(label, target, inside, indent + 2)
                word = "elif"
        self.say(indent + 1, "if True:" if word == "if" else "else:")
        self.go(label, args[1], inside, indent + 2)
        for target in flags:
            self.say(indent, f"if go=={target}:")
            self.say(indent + 1, "go=0")
            self.act(exits[target], indent + 1)

    def go(self, source, target, exits, indent, tail=False):
        """A branch. With tail the target is returned where the code goes on there."""
        values = self.phis.get((source, target), ())
        if values:
            names, sources = ",".join(f"t{n}" for n, _ in values), ",".join(self.value(v) for _, v in values)
            self.say(indent, f"{names}={sources}")
        if target in exits:
            return self.act(exits[target], indent)
        if tail:
            return target
        return self.blocks_from(target, exits, indent)

    def act(self, action, indent):
        if action[0] == "continue":
            _, first, header, merge = action
            self.blocks_from(first, {header: ("again",), merge: ("break",)}, indent)
        else:
            self.say(indent, {"fall": "pass", "break": "break", "again": "continue"}.get(action[0]) or
                     f"go={action[1]};break")

    # ---- instructions

    def components(self, number, count):
        """Expressions of each scalar of a value."""
        if count == 1 and self.kind(number).kind in ("int", "float", "bool"):
            return [self.value(number)]
        if number in self.constants:
            return [f"({v!r})" for v in self.constants[number]]
        return [f"t{number}[{i}]" for i in range(count)]

    def operation(self, op, number, kind, operands):
        """One expression a component, the category, whether rounded. Operands that are vectors go by component."""
        n = kind.size
        parts = [self.components(o, n) if self.kind(o).size > 1 else [self.value(o)] * n for o in operands]
        rows = list(zip(*parts)) if parts else []
        for table, category in ((FLOAT, "float"), (INTEGER, "integer"), (COMPARE, "compare"), (CONVERT, "convert")):
            if op in table:
                rounding = (category == "float" and op != 127) or op in ROUNDED_CONVERT
                expressions = [table[op].format(*row) for row in rows]
                break
        else:
            category, rounding = None, False
            if op == 124:
                source = self.kind(operands[0])
                source, target = (source.element or source).kind, (kind.element or kind).kind
                if source == target or "float" not in (source, target):
                    expressions = parts[0]
                else:
                    expressions = [("I" if source == "int" else "F", p) for p in parts[0]]
            elif op == 169:
                category, expressions = "compare", [f"({b} if {a} else {c})" for a, b, c in rows]
            elif op == 142:
                category, rounding = "float", True
                expressions = [f"{a}*{b}" for a, b in rows]
            else:
                raise NotImplementedError(f"instruction {op}")
        if n == 1:
            return expressions[0], category, rounding
        return expressions, category, rounding

    def assign(self, number, kind, expressions, rounding, indent):
        """One expression or one a component."""
        if isinstance(expressions, (str, tuple)) or kind.kind not in ("vector",):
            expressions = [expressions]
            names = [f"t{number}"]
        else:
            names = [f"t{number}_{i}" for i in range(len(expressions))]
        for name, e in zip(names, expressions):
            if isinstance(e, tuple):  # a bit cast
                e = f"{e[0]}[0]={e[1]};{name}={'F' if e[0] == 'I' else 'I'}[0]"
            else:
                e = f"R[0]={e};{name}=R[0]" if rounding else f"{name}={e}"
            self.say(indent, e)
        if len(names) > 1:
            self.say(indent, f"t{number}=({','.join(names)})")

    def instruction(self, op, args, indent, cost):
        if op == 59:
            kind = self.pointers[args[0]][1]
            if args[1] in self.local_scalars:
                self.refs[args[1]] = ("plain", f"v{args[1]}", "0", 0, kind)
                self.say(indent, f"v{args[1]}={self.value(args[3]) if len(args) > 3 else repr(self.zero(kind))}")
                return
            self.refs[args[1]] = (FUNCTION, f"t{args[1]}", "0", 0, kind)
            start = f"[{self.value(args[3])}]" if len(args) > 3 and kind.size == 1 else \
                f"list({self.value(args[3])})" if len(args) > 3 else repr(self.scalars(kind))
            self.say(indent, f"t{args[1]}={start}")
        elif op == 61:
            self.load(args, indent, cost)
        elif op == 62:
            self.store(args, indent, cost)
        elif op == 65 or op == 66:
            self.chain(args, indent)
        elif op == 57:
            self.call(args, indent)
        elif op == 12:
            expression, category, each, rounding = EXTENDED.get(args[3], (None, None, 0, 0))
            if args[2] != self.extended or expression is None:
                raise NotImplementedError(f"GLSL.std.450 instruction {args[3]}")
            kind = self.types[args[0]]
            rows = list(zip(*(self.components(o, kind.size) for o in args[4:])))
            expressions = [expression.format(*row) for row in rows]
            self.assign(args[1], kind, expressions if kind.size > 1 else expressions[0], rounding, indent)
            cost[category] += each * kind.size
        elif op == 148:  # Dot
            n = self.kind(args[2]).size
            terms = zip(self.components(args[2], n), self.components(args[3], n))
            for i, (a, b) in enumerate(terms):
                self.say(indent, f"R[0]={a}*{b};p=R[0]")
                self.say(indent, "s=p" if i == 0 else "R[0]=s+p;s=R[0]")
            self.say(indent, f"t{args[1]}=s")
            cost["float"] += 2 * n - 1
        elif op in (154, 155):
            self.say(indent, f"t{args[1]}={'any' if op == 154 else 'all'}({self.value(args[2])})")
            cost["compare"] += 1
        elif op == 80:  # CompositeConstruct
            parts = (self.value(o) if self.flat(o) else f"*{self.value(o)}" for o in args[2:])
            self.say(indent, f"t{args[1]}=({','.join(parts)},)")
        elif op == 81:  # CompositeExtract
            kind, at = self.kind(args[2]), 0
            for index in args[3:]:
                kind, step = kind.at(index)
                at += step
            self.say(indent, f"t{args[1]}={self.value(args[2])}[{self.span(at, kind)}]")
        elif op == 82:  # CompositeInsert
            kind, at = self.kind(args[3]), 0
            for index in args[4:]:
                kind, step = kind.at(index)
                at += step
            part = f"({self.value(args[2])},)" if self.flat(args[2]) else f"tuple({self.value(args[2])})"
            whole = f"tuple({self.value(args[3])})"
            self.say(indent, f"t{args[1]}={whole}[:{at}]+{part}+{whole}[{at + kind.size}:]")
        elif op == 79:  # VectorShuffle
            n = self.kind(args[2]).size
            sources = self.components(args[2], n) + self.components(args[3], self.kind(args[3]).size)
            self.say(indent, f"t{args[1]}=({','.join(sources[i] if i != MASK else '0' for i in args[4:])},)")
        elif op == 77:
            self.say(indent, f"t{args[1]}={self.value(args[2])}[{self.value(args[3])}]")
        elif op == 78:
            self.say(indent, f"t{args[1]}=list({self.value(args[2])})")
            self.say(indent, f"t{args[1]}[{self.value(args[4])}]={self.value(args[3])}")
        elif op in (83, 400):
            self.say(indent, f"t{args[1]}={self.value(args[2])}")
        elif op == 1:
            self.say(indent, f"t{args[1]}={self.zero(self.types[args[0]])!r}")
        elif op == 98:  # ImageRead
            self.say(indent, f"t{args[1]}=t{args[2]}[tuple({self.value(args[3])})]")
            cost["image"] += 1
        elif op == 99:  # ImageWrite
            self.say(indent, f"t{args[0]}[tuple({self.value(args[1])})]=tuple({self.value(args[2])})")
            cost["image"] += 1
        elif op == 104:  # ImageQuerySize
            self.say(indent, f"t{args[1]}=t{args[2]}.size")
        elif op == 68:  # ArrayLength
            _, _, binding, _ = self.variables[args[2]]
            stride = self.stride(self.variables[args[2]][1].members[args[3]])
            self.say(indent, f"t{args[1]}=len(B[{binding}])*4//{stride}")
        else:
            kind = self.types[args[0]]
            expressions, category, rounding = self.operation(op, args[1], kind, args[2:])
            self.assign(args[1], kind, expressions, rounding, indent)
            if category:
                cost[category] += kind.size

    def flat(self, number):
        return self.kind(number).kind in ("int", "float", "bool", "image")

    @staticmethod
    def span(at, kind):
        return f"{at}" if kind.kind in ("int", "float", "bool", "image") else f"{at}:{at + kind.size}"

    def stride(self, kind):
        return self.m.decorations.get(kind.number, {}).get(6)

    def reference(self, number):
        """(storage, list, offset expression, offset known beforehand, type); offsets in scalars, in blocks in bytes."""
        if number in self.refs:
            return self.refs[number]
        storage, kind, binding, builtin = self.variables[number]
        if storage in (STORAGE, UNIFORM):
            return storage, f"B[{binding}]", "0", 0, kind
        if storage == PUSH:
            return storage, "B['push']", "0", 0, kind
        if storage == UNIFORM_CONSTANT:
            return storage, f"B[{binding}]", "0", 0, kind
        if storage == INPUT:
            return storage, f"B['in{builtin}']", "0", 0, kind
        return storage, f"g{number}", "0", 0, kind

    def chain(self, args, indent):
        storage, base, dynamic, known, kind = self.reference(args[2])
        blocks = storage in (STORAGE, UNIFORM, PUSH)
        terms = [] if dynamic == "0" else [dynamic]
        for index in args[3:]:
            if kind.kind == "struct":
                member = self.constants[index]
                known += self.m.member_offsets[kind.number, member] if blocks else kind.at(member)[1]
                kind = kind.members[member]
                continue
            size = kind.element.size
            if blocks:
                size = 4 if kind.kind == "vector" else self.stride(kind)
            if index in self.constants:
                known += size * self.constants[index]
            else:
                terms.append(f"{self.value(index)}*{size}" if size > 1 else self.value(index))
            kind = kind.element
        dynamic = "0"
        if terms:
            dynamic = f"o{args[1]}"
            self.say(indent, f"{dynamic}={'+'.join(terms)}")
        self.refs[args[1]] = (storage, base, dynamic, known, kind)

    @staticmethod
    def offset(dynamic, known, more=0):
        known += more
        return str(known) if dynamic == "0" else dynamic if known == 0 else f"{dynamic}+{known}"

    def block_scalars(self, kind, offset=0):
        """(byte offset, kind) of each scalar of a type in a block."""
        if kind.kind == "struct":
            for i, m in enumerate(kind.members):
                yield from self.block_scalars(m, offset + self.m.member_offsets[kind.number, i])
        elif kind.kind in ("vector", "array"):
            size = 4 if kind.kind == "vector" else self.stride(kind)
            for i in range(kind.size // kind.element.size):
                yield from self.block_scalars(kind.element, offset + i * size)
        else:
            yield offset, kind.kind

    def load(self, args, indent, cost):
        storage, base, dynamic, known, kind = self.reference(args[2])
        name = f"t{args[1]}"
        if storage == "plain":
            self.say(indent, f"{name}={base}")
        elif storage == UNIFORM_CONSTANT:
            self.say(indent, f"{name}={base}")
        elif storage in (STORAGE, UNIFORM, PUSH):
            scalars = list(self.block_scalars(kind))
            names = []
            for i, (byte, scalar) in enumerate(scalars):
                if dynamic == "0":
                    at = f"{base}[{(known + byte) // 4}]"
                else:
                    at = f"{base}[({self.offset(dynamic, known, byte)})>>2]"
                names.append(name if len(scalars) == 1 else f"{name}_{i}")
                self.say(indent, f"I[0]={at};{names[-1]}=F[0]" if scalar == "float" else f"{names[-1]}={at}")
            if kind.kind not in ("int", "float"):
                self.say(indent, f"{name}=({','.join(names)},)")
            cost[("read", self.variables[self.root(args[2])][2]) if storage == STORAGE else "uniform"] += len(scalars)
        elif kind.kind in ("int", "float", "bool"):
            self.say(indent, f"{name}={base}[{self.offset(dynamic, known)}]")
        else:
            self.say(indent, f"{name}={base}[{self.offset(dynamic, known)}:{self.offset(dynamic, known, kind.size)}]")

    def root(self, number):
        """The variable that an access chain begins at."""
        while number not in self.variables:
            number = self.chains[number]
        return number

    def store(self, args, indent, cost):
        storage, base, dynamic, known, kind = self.reference(args[0])
        value = self.value(args[1])
        if storage == "plain":
            self.say(indent, f"{base}={value}")
        elif storage == STORAGE:
            scalars = list(self.block_scalars(kind))
            parts = self.components(args[1], len(scalars))
            for (byte, scalar), part in zip(scalars, parts):
                if scalar == "float":
                    self.say(indent, f"F[0]={part}")
                    part = "I[0]"
                self.say(indent, f"{base}[({self.offset(dynamic, known, byte)})>>2]={part}")
            cost["write"] += len(scalars)
        elif kind.kind in ("int", "float", "bool"):
            self.say(indent, f"{base}[{self.offset(dynamic, known)}]={value}")
        else:
            self.say(indent, f"{base}[{self.offset(dynamic, known)}:{self.offset(dynamic, known, kind.size)}]={value}")

    def call(self, args, indent):
        target, name = args[2], self.m.name(args[2])
        account = f"C[{name!r}]" if name in self.apart else "N"
        given = []
        for number in args[3:]:
            if number in self.refs or number in self.variables:
                storage, base, dynamic, known, _ = self.reference(number)
                if dynamic != "0" or known != 0:
                    raise NotImplementedError("a pointer into a variable as an argument")
                given.append(base)
            else:
                given.append(self.value(number))
        self.say(indent, f"t{args[1]}=f{target}({','.join([account, *given])})")
        if name in self.apart:
            self.say(indent, f"V[{name!r}].append(t{args[1]})")

    # ---- running it

    def run(self, invocation, bindings, push=()):
        """One invocation of main. bindings: by number lists of words, or for images dicts from (x, y) to four numbers.

        Returns {account: Counter}, account "" and those of `apart`; ("call", name) in account "" says how often a
        function ran, wherever."""
        for account in self.accounts.values():
            account[:] = [0] * len(account)
        self.returned.update((name, []) for name in self.apart)
        x, y, z = (*invocation, 0, 0)[:3]
        bound = {**bindings, "push": list(push), f"in{GLOBAL_INVOCATION}": [x, y, z],
                 f"in{WORKGROUP_ID}": [x, y, z], f"in{LOCAL_INVOCATION}": [0, 0, 0], f"in{LOCAL_INDEX}": [0]}
        self.env["B"] = bound
        self.env[f"f{self.m.entry}"](self.accounts[""])
        result = {}
        for name, account in self.accounts.items():
            total = result[name] = Counter()
            for times, cost in zip(account, self.costs):
                if times:
                    for category, n in cost.items():
                        total[category] += times * n
        for number, block in self.entries.items():
            result[""]["call", self.m.name(number)] += sum(a[block] for a in self.accounts.values())
        return result


def load(path):
    with open(path, "rb") as stream:
        return Module(stream.read())
