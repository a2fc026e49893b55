#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs a FUNCTION_BLOCK in IEC 61131-3 structured text, as far as resonid writes it:

    structured_text.py BLOCK.st INPUT ... < rows      one call a row: the values of the named inputs

prints `torque wrong_cycle_time` after each call. What is not known (a word, an undeclared or constant variable, a type
that does not fit) ends it with an error."""
import re
import sys

TOKEN = re.compile(r"\s+|(?P<token>:=|<=|>=|<>|[-+*/();:<>]|\d+\.\d+(?:[eE][-+]?\d+)?|[A-Za-z][A-Za-z0-9_]*)")
WORDS = {"IF", "THEN", "ELSIF", "ELSE", "END_IF", "RETURN", "AND", "OR", "NOT", "ABS", "TRUE", "FALSE"}


class Return(Exception):
    pass


def tokens_of(text):
    text, at, tokens = re.sub(r"\(\*.*?\*\)", " ", text, flags=re.S), 0, []
    while at < len(text):
        match = TOKEN.match(text, at)
        if not match:
            raise SyntaxError(f"unknown: {text[at:at + 20]!r}")
        if match["token"]:
            tokens.append(match["token"])
        at = match.end()
    return tokens


class Block:
    def __init__(self, text):
        self.tokens, self.at = tokens_of(text), 0
        self.values, self.types, self.constants, self.inputs = {}, {}, set(), set()
        self.take("FUNCTION_BLOCK")
        self.name = self.take()
        while self.next().startswith("VAR"):
            self.declarations()
        self.body = self.statements({"END_FUNCTION_BLOCK"})
        self.take("END_FUNCTION_BLOCK")
        if self.at != len(self.tokens):
            raise SyntaxError("text after the block")

    def next(self):
        return self.tokens[self.at]

    def take(self, *allowed):
        token = self.tokens[self.at]
        if allowed and token not in allowed:
            raise SyntaxError(f"{token} instead of {allowed}")
        self.at += 1
        return token

    def declarations(self):
        kind = self.take("VAR", "VAR_INPUT", "VAR_OUTPUT")
        constant = kind == "VAR" and self.next() == "CONSTANT" and bool(self.take())
        while self.next() != "END_VAR":
            name = self.take()
            if name.upper() in WORDS or name.upper() in map(str.upper, self.values) or "__" in name:
                raise SyntaxError(f"bad name {name}")
            self.take(":")
            self.types[name] = self.take("LREAL", "BOOL")
            self.values[name] = 0.0 if self.types[name] == "LREAL" else False
            if self.next() == ":=":
                self.take()
                value = self.expression()(self)
                self.check(name, value)
                self.values[name] = value
            self.take(";")
            if constant:
                self.constants.add(name)
            if kind == "VAR_INPUT":
                self.inputs.add(name)
        self.take("END_VAR")

    def check(self, name, value):
        if type(value) is not (float if self.types[name] == "LREAL" else bool):
            raise TypeError(f"{name} := {value!r}")

    # Statements: lists of functions of the block.
    def statements(self, ends):
        body = []
        while self.next() not in ends:
            body.append(self.statement())
        return body

    def statement(self):
        if self.next() == "IF":
            return self.branches()
        if self.next() == "RETURN":
            self.take()
            self.take(";")

            def leave(block):
                raise Return
            return leave
        name = self.take()
        if name not in self.values or name in self.constants or name in self.inputs:
            raise SyntaxError(f"{name} cannot be assigned")
        self.take(":=")
        value = self.expression()
        self.take(";")

        def assign(block):
            new = value(block)
            block.check(name, new)
            block.values[name] = new
        return assign

    def branches(self):
        cases = []
        while self.take("IF", "ELSIF", "ELSE", "END_IF") != "END_IF":
            condition = (lambda block: True) if self.tokens[self.at - 1] == "ELSE" else self.expression()
            if self.tokens[self.at - 1] != "ELSE":
                self.take("THEN")
            cases.append((condition, self.statements({"ELSIF", "ELSE", "END_IF"})))
        self.take(";")

        def choose(block):
            for condition, body in cases:
                if condition(block) is True:
                    return block.run(body)
        return choose

    # Expressions, weakest operators first.
    def binary(self, operand, operators):
        left = operand()
        while self.next() in operators:
            left = self.joined(operators[self.take()], left, operand())
        return left

    @staticmethod
    def joined(operator, left, right):
        return lambda block: operator(left(block), right(block))

    def expression(self):
        return self.binary(self.conjunction, {"OR": lambda a, b: self.truth(a) | self.truth(b)})

    def conjunction(self):
        return self.binary(self.comparison, {"AND": lambda a, b: self.truth(a) & self.truth(b)})

    def comparison(self):
        return self.binary(self.sum, {">": lambda a, b: self.number(a) > self.number(b),
                                      "<": lambda a, b: self.number(a) < self.number(b)})

    def sum(self):
        return self.binary(self.product, {"+": lambda a, b: self.number(a) + self.number(b),
                                          "-": lambda a, b: self.number(a) - self.number(b)})

    def product(self):
        return self.binary(self.unary, {"*": lambda a, b: self.number(a) * self.number(b)})

    @staticmethod
    def number(x):
        if type(x) is not float:
            raise TypeError(x)
        return x

    @staticmethod
    def truth(x):
        if type(x) is not bool:
            raise TypeError(x)
        return x

    def unary(self):
        token = self.take()
        if token == "-":
            operand = self.unary()
            return lambda block: -block.number(operand(block))
        if token == "NOT":
            operand = self.unary()
            return lambda block: not block.truth(operand(block))
        if token in ("(", "ABS"):
            if token == "ABS":
                self.take("(")
            inner = self.expression()
            self.take(")")
            return inner if token == "(" else lambda block: abs(block.number(inner(block)))
        if token in ("TRUE", "FALSE"):
            return lambda block: token == "TRUE"
        if token[0].isdigit():
            value = float(token)
            return lambda block: value
        if token not in self.values:
            raise SyntaxError(f"{token} is not declared")
        return lambda block: block.values[token]

    def run(self, body):
        for statement in body:
            statement(self)

    def call(self, inputs):
        for name, value in inputs.items():
            if name not in self.inputs:
                raise SyntaxError(f"{name} is no input")
            self.values[name] = value if self.types[name] == "LREAL" else value != 0.0
        try:
            self.run(self.body)
        except Return:
            pass


def main():
    with open(sys.argv[1]) as file:
        block = Block(file.read())
    for row in sys.stdin:
        block.call(dict(zip(sys.argv[2:], map(float, row.split()))))
        print(repr(block.values["torque"]), int(block.values["wrong_cycle_time"]))


main()
