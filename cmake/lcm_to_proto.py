"""lcm_to_proto.py TYPE.lcm... FOLDER: the LCM types of package vog as Protobuf messages of package
vogmap, FOLDER/vogmap/messages.proto, and FOLDER/vogmap/to_proto.h, functions that turn the ones into
the others. Names stay, but pose_estimate_t becomes PoseEstimate; arrays of arrays are laid out one
after the other; where has_open tells whether open means something, open is there or not. Fails with
one line where a type is not understood."""

import pathlib
import re
import sys

SCALARS = {"int8_t": "int32", "int16_t": "int32", "int32_t": "int32", "int64_t": "int64",
           "float": "float", "double": "double", "boolean": "bool", "string": "string"}
STRUCT = re.compile(r"^\s*package vog;\s*struct (\w+)_t\s*\{(.*)\}\s*$", re.DOTALL)
FIELD = re.compile(r"^([\w.]+)\s+(\w+)((?:\[\w+\])*)$")


class Field:
    def __init__(self, lcm_type, name, dimensions):
        self.lcm_type, self.name = lcm_type, name
        self.depth = dimensions.count("[")
        self.is_bytes = lcm_type == "byte"
        self.is_struct = lcm_type not in SCALARS and not self.is_bytes
        self.condition = ""

    def to_proto(self, number):
        if self.is_bytes:
            return f"  bytes {self.name} = {number};\n"
        kind = proto_name(self.lcm_type) if self.is_struct else SCALARS[self.lcm_type]
        return f"  {'repeated ' if self.depth else ''}{kind} {self.name} = {number};\n"

    def to_cpp(self):
        accessor = self.name.lower()  # As protoc has it.
        value = f"from.{self.name}"
        if self.is_bytes:
            return f"  to.set_{accessor}({value}.data(), {value}.size());\n"
        loops, indent = "", "  "
        for level in range(self.depth):
            loops += f"{indent}for (const auto& value_{level} : {value})\n"
            value, indent = f"value_{level}", indent + "  "
        if self.lcm_type == "string":
            value = f"ToUtf8({value})"
        if self.is_struct:
            owner = f"add_{accessor}" if self.depth else f"mutable_{accessor}"
            return f"{loops}{indent}{self.condition}*to.{owner}() = ToProto({value});\n"
        return f"{loops}{indent}to.{'add' if self.depth else 'set'}_{accessor}({value});\n"


class Message:
    def __init__(self, path):
        text = re.sub(r"//[^\n]*", "", path.read_text())
        match = STRUCT.match(text) or fail(path, "not a struct of package vog")
        self.lcm_name = match[1] + "_t"
        self.fields = []
        for statement in match[2].split(";"):
            statement = " ".join(statement.split())
            if not statement or statement.startswith("const "):
                continue
            field = FIELD.match(statement) or fail(path, f"not understood: {statement}")
            self.fields.append(Field(*field.groups()))
            if self.fields[-1].is_bytes and self.fields[-1].depth != 1:
                fail(path, f"only a list of bytes is understood: {statement}")
        self.turn_flags_into_presence()

    def turn_flags_into_presence(self):
        """Protobuf has a has_open() of its own for a struct open."""
        flags = {f"has_{field.name}": field for field in self.fields if field.is_struct}
        for flag in [field for field in self.fields if field.name in flags]:
            flags[flag.name].condition = f"if (from.{flag.name}) "
            self.fields.remove(flag)

    def to_proto(self):
        fields = "".join(field.to_proto(i) for i, field in enumerate(self.fields, 1))
        return f"message {proto_name(self.lcm_name)} {{\n{fields}}}\n"

    def signature(self):
        return f"inline vogmap::{proto_name(self.lcm_name)} ToProto(const {self.lcm_name}& from)"

    def to_cpp(self):
        fields = "".join(field.to_cpp() for field in self.fields)
        return (f"{self.signature()} {{\n  vogmap::{proto_name(self.lcm_name)} to;\n{fields}"
                "  return to;\n}\n")


def proto_name(lcm_name):
    return "".join(part.capitalize() for part in lcm_name.removesuffix("_t").split("_"))


def fail(path, text):
    sys.exit(f"{path}: {text}")


def main():
    *sources, folder = (pathlib.Path(argument) for argument in sys.argv[1:])
    messages = [Message(source) for source in sources]
    folder /= "vogmap"
    folder.mkdir(parents=True, exist_ok=True)
    made = "// Made of lcmtypes/*.lcm by lcm_to_proto.py.\n"
    (folder / "messages.proto").write_text(
        f'{made}syntax = "proto3";\n\npackage vogmap;\n\n'
        + "\n".join(message.to_proto() for message in messages))
    includes = "".join(f'#include "vog/{message.lcm_name}.hpp"\n' for message in messages)
    (folder / "to_proto.h").write_text(
        f'{made}#pragma once\n\n#include "lib/foxglove/utf8.h"\n{includes}'
        '#include "vogmap/messages.pb.h"\n\nnamespace vog {\n\n'
        + "".join(message.signature() + ";\n" for message in messages) + "\n"
        + "\n".join(message.to_cpp() for message in messages) + "\n}  // namespace vog\n")


if __name__ == "__main__":
    main()
