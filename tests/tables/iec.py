"""An interpreter of the Structured Text that is exported: BOOL, DINT, LREAL and their arrays.

It knows no conversion that is not written, so that a block it runs mixes no types, and it
refuses a word that it does not know.
"""

import math
import re

TOKEN = re.compile(
    r"(?P<skip>\s+|\(\*.*?\*\)|\{.*?\})|(?P<real>\d+\.\d+(?:[eE][+-]?\d+)?)|(?P<range>\.\.)"
    r"|(?P<int>\d+)|(?P<word>[#\"]?[A-Za-z]\w*\"?)|(?P<sign>:=|<=|>=|<>|[-+*/<>=()\[\],;:.])",
    re.DOTALL,
)
ZERO = {"BOOL": False, "DINT": 0, "LREAL": 0.0}
FUNCTIONS = {
    "DINT_TO_LREAL": ("DINT", "LREAL", "float"),
    "TRUNC": ("LREAL", "DINT", "math.trunc"),
    "ABS": ("LREAL", "LREAL", "abs"),
}
LEVELS = (("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD"))
PYTHON = {"OR": "or", "AND": "and", "=": "==", "<>": "!="}


class Block:
    """A running instance: variables are attributes, in capitals."""

    def __init__(self, kind):
        self._kind = kind
        for name, (type_, start) in kind.variables.items():
            if isinstance(type_, Kind):
                setattr(self, name, Block(type_))
            else:
                setattr(self, name, list(start) if isinstance(start, list) else start)

    def __call__(self, **inputs):
        for name, value in inputs.items():
            assert name.upper() in self._kind.inputs, name
            setattr(self, name.upper(), value)
        self._kind.run(self)
        return self


class Kind:
    def __init__(self, name):
        self.name, self.variables, self.inputs, self.constants = name, {}, set(), set()


def load(text):
    """Return the function blocks and programs of a text by name."""
    return Reader(text).units()


class Reader:
    def __init__(self, text):
        self.tokens, place = [], 0
        while place < len(text):
            found = TOKEN.match(text, place)
            assert found, text[place : place + 40]
            place = found.end()
            if found.lastgroup != "skip":
                word = found[0].strip('"#').upper()
                self.tokens.append((found.lastgroup, word))
        self.tokens.append(("end", ""))
        self.at, self.kinds = 0, {}

    def next(self, *wanted):
        kind, word = self.tokens[self.at]
        assert not wanted or word in wanted or kind in wanted, (
            word,
            wanted,
            self.tokens[self.at - 5 : self.at],
        )
        self.at += 1
        return word

    def sees(self, *words):
        return self.tokens[self.at][1] in words

    def skip(self, word):
        found = self.sees(word)
        self.at += found
        return found

    def units(self):
        while self.tokens[self.at][0] != "end":
            what = self.next("FUNCTION_BLOCK", "PROGRAM")
            self.kind = Kind(self.next("word"))
            if self.skip("VERSION"):
                self.next(":")
                self.next("real")
            while self.sees("VAR", "VAR_INPUT", "VAR_OUTPUT"):
                self.section()
            self.skip("BEGIN")
            lines = self.statements(1, f"END_{what}")
            self.next(f"END_{what}")
            space = {"math": math, "mod": lambda a, b: int(math.fmod(a, b))}
            exec("def run(s):\n" + "\n".join(lines or ["    pass"]), space)
            self.kind.run = space["run"]
            self.kinds[self.kind.name] = self.kind
        return self.kinds

    def section(self):
        inputs = self.next() == "VAR_INPUT"
        constant = self.skip("CONSTANT")
        while not self.skip("END_VAR"):
            name = self.next("word")
            assert name not in self.kind.variables
            self.next(":")
            size = None
            if self.skip("ARRAY"):
                self.next("["), self.next("0"), self.next("..")
                size = int(self.next("int")) + 1
                self.next("]"), self.next("OF")
            type_ = self.next("word")
            if type_ in self.kinds:
                self.kind.variables[name] = self.kinds[type_], None
            else:
                start = ZERO[type_] if size is None else [ZERO[type_]] * size
                if self.skip(":="):
                    start = self.literals(type_, size)
                assert not constant or start is not None
                self.kind.variables[name] = (type_, size), start
            if inputs:
                self.kind.inputs.add(name)
            if constant:
                self.kind.constants.add(name)
            self.next(";")

    def literals(self, type_, size):
        if size is None:
            return self.literal(type_)
        self.next("[")
        values = [self.literal(type_)]
        while self.skip(","):
            values.append(self.literal(type_))
        self.next("]")
        assert len(values) == size
        return values

    def literal(self, type_):
        if type_ == "BOOL":
            return self.next("TRUE", "FALSE") == "TRUE"
        sign = -1 if self.skip("-") else 1
        return sign * (int(self.next("int")) if type_ == "DINT" else float(self.next("real")))

    def statements(self, depth, *ends):
        lines, pad = [], "    " * depth
        while not self.sees(*ends):
            if self.skip("IF"):
                lines.append(f"{pad}if {self.typed('BOOL')}:")
                self.next("THEN")
                lines += self.branch(depth, "ELSIF", "ELSE", "END_IF")
                while self.skip("ELSIF"):
                    lines.append(f"{pad}elif {self.typed('BOOL')}:")
                    self.next("THEN")
                    lines += self.branch(depth, "ELSIF", "ELSE", "END_IF")
                if self.skip("ELSE"):
                    lines += [f"{pad}else:", *self.branch(depth, "END_IF")]
                self.next("END_IF")
            elif self.skip("FOR"):
                target, type_ = self.place()
                assert type_ == "DINT"
                self.next(":=")
                first = self.typed("DINT")
                self.next("TO")
                lines.append(f"{pad}for {target} in range({first}, {self.typed('DINT')} + 1):")
                self.next("DO")
                lines += self.branch(depth, "END_FOR")
                self.next("END_FOR")
            else:
                lines.append(pad + self.action())
            self.next(";")
        return lines

    def branch(self, depth, *ends):
        return self.statements(depth + 1, *ends) or ["    " * (depth + 1) + "pass"]

    def action(self):
        target, type_ = self.place(assigned=True)
        if not isinstance(type_, Kind):
            self.next(":=")
            return f"{target} = {self.typed(type_)}"
        self.next("(")
        given = []
        while not self.skip(")"):
            name = self.next("word")
            assert name in type_.inputs
            self.next(":=")
            value, of = self.expression()
            wanted = type_.variables[name][0]
            assert of == (wanted[0] if wanted[1] is None else wanted)
            given.append(f"{name}={value if wanted[1] is None else f'list({value})'}")
            self.skip(",")
        return f"{target}({', '.join(given)})"

    def place(self, assigned=False):
        name = self.next("word")
        type_ = self.kind.variables[name][0]
        assert not (assigned and name in self.kind.constants), name
        text = f"s.{name}"
        if isinstance(type_, Kind):
            if not self.skip("."):
                return text, type_
            part = self.next("word")
            assert not assigned or part in type_.inputs
            text, type_ = f"{text}.{part}", type_.variables[part][0]
        if self.skip("["):
            text += f"[{self.typed('DINT')}]"
            self.next("]")
            return text, type_[0]
        return text, type_ if type_[1] is not None else type_[0]

    def typed(self, wanted):
        text, type_ = self.expression()
        assert type_ == wanted, (text, type_, wanted)
        return text

    def expression(self, level=0):
        if level == len(LEVELS):
            return self.unary()
        text, type_ = self.expression(level + 1)
        while self.sees(*LEVELS[level]):
            sign = self.next()
            other, same = self.expression(level + 1)
            assert type_ == same, (text, sign, other)
            assert level == 2 or (type_ == "BOOL") == (level < 2), (text, sign, other)
            assert sign != "MOD" or type_ == "DINT"
            assert sign != "/" or type_ == "LREAL"
            if sign == "MOD":
                text = f"mod({text}, {other})"
            else:
                text = f"({text} {PYTHON.get(sign, sign)} {other})"
            if level in (2, 3):
                type_ = "BOOL"
        return text, type_

    def unary(self):
        if self.skip("NOT"):
            text, type_ = self.unary()
            assert type_ == "BOOL"
            return f"(not {text})", type_
        if self.skip("-"):
            text, type_ = self.unary()
            assert type_ in ("DINT", "LREAL")
            return f"(-{text})", type_
        if self.skip("("):
            found = self.expression()
            self.next(")")
            return found
        kind, word = self.tokens[self.at]
        if kind in ("real", "int"):
            self.at += 1
            return word, {"real": "LREAL", "int": "DINT"}[kind]
        if word in ("TRUE", "FALSE"):
            self.at += 1
            return word.title(), "BOOL"
        if word in FUNCTIONS:
            self.at += 1
            takes, gives, python = FUNCTIONS[word]
            self.next("(")
            text = self.typed(takes)
            self.next(")")
            return f"{python}({text})", gives
        return self.place()
