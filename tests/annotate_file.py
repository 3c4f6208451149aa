#!/usr/bin/env python3
"""The byte-by-byte listing of spec/btfc.md section 10, made from tests/vectors/patch/annotated.btfc.

annotate_file.py SOURCE_DIR           exit 1 where the page's listing is not this one
annotate_file.py SOURCE_DIR --write   puts it there
"""

import re
import struct
import sys
from pathlib import Path

HEADER = [(12, "magic"), (2, "version_major"), (2, "version_minor"), (4, "incompatible_features"),
          (4, "compatible_features"), (4, "chunk_count"), (4, "align_log2"), (8, "file_bytes"), (8, "payload_bytes"),
          (8, "reserved"), (8, "directory_hash")]
ENTRY = [(4, "type"), (2, "flags"), (2, "codec"), (8, "offset"), (8, "stored_bytes"), (8, "raw_bytes"),
         (8, "raw_hash"), (4, "key_a"), (4, "key_b")]
HEAD = [(4, "model"), (4, "width"), (4, "height"), (4, "view_count"), (4, "light_count"), (4, "pair_count"),
        (1, "map_count"), (1, "channel_count"), (1, "wrap_u"), (1, "wrap_v"), (1, "unbounded"), (1, "quantity"),
        (1, "value_transform"), (1, "reserved"), (24, "map 0: name"), (1, "map 0: channel_count"),
        (1, "map 0: sample_type"), (1, "map 0: colour_space"), (1, "map 0: alpha"), (4, "map 0: reserved")]
PARM = [(4, "sample_width"), (4, "sample_height"), (4, "patch_count_x"), (4, "patch_count_y"), (4, "patch_size"),
        (4, "overlap"), (1, "blend"), (1, "cut_layout"), (2, "reserved")]


def listing(data):
    lines = []

    def row(at, size, meaning):
        part = data[at:at + size]
        for i in range(0, size, 12):  # long fields take several lines
            text = part[i:i + 12].hex(" ").upper()
            lines.append(f"{at + i:5}  {text:<35}  {meaning if i == 0 else ''}".rstrip())

    def fields(at, table, prefix):
        for size, name in table:
            part = data[at:at + size]
            text = part.rstrip(b"\0").decode("ascii", "replace")
            value = f" '{text}'" if "name" in name or name == "type" else ""
            if not value and size <= 8 and not name.endswith("hash"):
                value = f" {int.from_bytes(part, 'little')}"
            row(at, size, f"{prefix}{name}{value}")
            at += size
        return at

    at = fields(0, HEADER, "header: ")
    entries = []
    for i in range(struct.unpack_from("<I", data, 24)[0]):
        entries.append((data[at:at + 4].decode(), *struct.unpack_from("<QQ", data, at + 8)))
        at = fields(at, ENTRY, f"entry {i}: ")
    for kind, offset, stored in entries:
        if offset > at:
            row(at, offset - at, "padding")
        if kind in ("HEAD", "PARM"):
            fields(offset, HEAD if kind == "HEAD" else PARM, f"{kind}: ")
        elif kind == "META":
            row(offset, stored, "META: " + " / ".join(data[offset:offset + stored].decode().splitlines()))
        else:
            what = {"COOR": "patch 0 at (0, 0), then padding", "SMPL": "codes of the four texels"}[kind]
            row(offset, stored, f"{kind}: {what}")
        at = offset + stored
    assert at == len(data)
    return "```\n" + "\n".join(lines) + "\n```"


def main():
    source = Path(sys.argv[1])
    page = source / "spec" / "btfc.md"
    text = page.read_text()
    wanted = "<!-- annotated:begin -->\n" + listing((source / "tests/vectors/patch/annotated.btfc").read_bytes()) + \
        "\n<!-- annotated:end -->"
    pattern = re.compile(r"<!-- annotated:begin -->\n.*<!-- annotated:end -->", re.S)
    if "--write" in sys.argv:
        page.write_text(pattern.sub(lambda _: wanted, text))
    elif wanted not in text:
        print("spec/btfc.md section 10 is not the listing of annotated.btfc; run tests/annotate_file.py . --write")
        return 1
    return 0


sys.exit(main())
