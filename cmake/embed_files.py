"""embed_files.py OUT.cc FILE...: the files as they are, in vog::EmbeddedPages(), by their names; index.html
is also what / leads to."""

import pathlib
import sys

TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8",
         ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml"}
PIECE = 8192


def literal(content):
    """String literals of moderate length; octal escapes where a byte is not plain."""
    plain = {i: chr(i) for i in range(32, 127) if chr(i) not in '"\\?'}
    text = [plain.get(byte, f"\\{byte:03o}") for byte in content]
    pieces = ["".join(text[i:i + PIECE]) for i in range(0, len(text), PIECE)] or [""]
    return "\n".join(f'"{piece}"' for piece in pieces)


def main():
    out, *files = (pathlib.Path(argument) for argument in sys.argv[1:])
    rows = []
    for file in files:
        content = file.read_bytes()
        names = ["/" + file.name] + (["/"] if file.name == "index.html" else [])
        for name in names:
            rows.append(f'{{"{name}", {{"{TYPES[file.suffix]}", std::string({literal(content)}, {len(content)})}}}},')
    out.write_text('// Made by embed_files.py.\n#include "procs/viewer/pages.h"\n\nnamespace vog {\n\n'
                   "const std::map<std::string, PageFile>& EmbeddedPages() {\n"
                   "  static const std::map<std::string, PageFile> pages = {\n"
                   + "\n".join(rows) + "\n  };\n  return pages;\n}\n\n}  // namespace vog\n")


if __name__ == "__main__":
    main()
