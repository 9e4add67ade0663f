"""dbc_to_cpp.py FILE.dbc FILE.h: a struct a message, with the table of its signals and one visit over
them that packs and unpacks. Fails with one line where the messages cannot be."""

import pathlib
import re
import sys

NUMBER = r"[-+0-9.eE]+"
MESSAGE = re.compile(r"^BO_ (\d+) (\w+) *: *(\d+) \w+")
SIGNAL = re.compile(rf'^ SG_ (\w+) : (\d+)\|(\d+)@([01])([+-]) \(({NUMBER}),({NUMBER})\) '
                    rf'\[({NUMBER})\|({NUMBER})\] "([^"]*)"')
COMMENT = re.compile(r'^CM_ (BO_|SG_) (\d+)(?: (\w+))? "([^"]*)" *;', re.MULTILINE)
EXTENDED = 1 << 31


class Signal:
    def __init__(self, fields):
        self.name, start, length, order, sign, *numbers, self.unit = fields
        self.start, self.length = int(start), int(length)
        self.motorola, self.signed = order == "0", sign == "-"
        self.scale, self.offset, self.low, self.high = (float(number) for number in numbers)
        self.comment = ""

    def bits(self):
        """The bits of the frame it takes, the lowest of each byte first in counting."""
        if not self.motorola:
            return list(range(self.start, self.start + self.length))
        bits = [self.start]
        while len(bits) < self.length:
            bits.append(bits[-1] + 15 if bits[-1] % 8 == 0 else bits[-1] - 1)
        return bits

    def limits(self):
        """What its raw number can say, scaled."""
        low = -(1 << (self.length - 1)) if self.signed else 0
        ends = [self.offset + self.scale * raw for raw in (low, low + (1 << self.length) - 1)]
        return min(ends), max(ends)

    def table_row(self):
        flags = ", ".join(str(flag).lower() for flag in (self.motorola, self.signed))
        numbers = ", ".join(repr(n) for n in (self.scale, self.offset, self.low, self.high))
        return f"CanSignal{{{self.start}, {self.length}, {flags}, {numbers}}}"


class Message:
    def __init__(self, identifier, name, size):
        self.extended = bool(identifier & EXTENDED)
        self.id = identifier & ~EXTENDED
        self.name = "".join(part.capitalize() for part in name.split("_"))
        self.size = size
        self.comment = ""
        self.signals = []

    def check(self):
        taken = set()
        if self.size > 8:
            fail(f"{self.name}: {self.size} bytes, a classic frame has 8")
        for signal in self.signals:
            bits = set(signal.bits())
            low, high = signal.limits()
            where = f"{self.name}.{signal.name}"
            if not 1 <= signal.length <= 53:
                fail(f"{where}: {signal.length} bits, a number of double precision has 53")
            if min(bits) < 0 or max(bits) >= 8 * self.size:
                fail(f"{where}: beyond the frame")
            if bits & taken:
                fail(f"{where}: overlaps another signal")
            if signal.scale == 0 or not low <= signal.low <= signal.high <= high * (1 + 1e-12):
                fail(f"{where}: its range is not what its bits can say")
            taken |= bits

    def to_cpp(self):
        fields = "".join(f"  double {s.name} = 0;{comment_of(s)}\n" for s in self.signals)
        rows = "".join(f"      {s.table_row()},\n" for s in self.signals)
        visits = "".join(f"    visit(kSignals[{i}], {s.name});\n"
                         for i, s in enumerate(self.signals))
        return (f"/// {self.comment}\nstruct {self.name} {{\n"
                f"  static constexpr std::uint32_t kId = {self.id:#x};\n"
                f"  static constexpr bool kExtended = {str(self.extended).lower()};\n"
                f"  static constexpr std::uint8_t kSize = {self.size};\n{fields}\n"
                f"  static constexpr std::array kSignals = {{\n{rows}  }};\n"
                f"  template <class Visitor>\n  void Visit(Visitor&& visit) {{\n{visits}  }}\n}};\n\n")


def comment_of(signal):
    words = f"[{signal.unit}] {signal.comment}" if signal.unit else signal.comment
    return f"  ///< {words.strip()}" if words else ""


def fail(text):
    sys.exit(f"{sys.argv[1]}: {text}")


def parse(text):
    messages = {}
    message = None
    for line in text.splitlines():
        if match := MESSAGE.match(line):
            identifier = int(match[1])
            if identifier in messages:
                fail(f"identifier {identifier} twice")
            message = messages[identifier] = Message(identifier, match[2], int(match[3]))
        elif match := SIGNAL.match(line):
            message.signals.append(Signal(match.groups()))
        elif line.startswith((" SG_", "BO_ ")):
            fail(f"not understood: {line.strip()}")
    for kind, identifier, name, words in COMMENT.findall(text):
        owner = messages[int(identifier)]
        for target in [owner] if kind == "BO_" else owner.signals:
            if kind == "BO_" or target.name == name:
                target.comment = " ".join(words.split())
    return messages.values()


def main():
    source, header = (pathlib.Path(argument) for argument in sys.argv[1:])
    messages = parse(source.read_text())
    for message in messages:
        message.check()
    header.parent.mkdir(parents=True, exist_ok=True)
    header.write_text(
        f"// Made of {source.name} by dbc_to_cpp.py.\n#pragma once\n\n#include <array>\n"
        '#include <cstdint>\n\n#include "hardware/nav_payload/can_signal.h"\n\n'
        "namespace vog::dbc {\n\n" + "".join(m.to_cpp() for m in messages) + "}  // namespace vog::dbc\n")


if __name__ == "__main__":
    main()
