#!/usr/bin/env python3
"""What the reference reader says about files that come over standard input: a length of 4 bytes, then the file.
Answers a line each: "ok", "invalid D8" or "unsupported F3". fuzz_differential.cpp keeps one running."""

import io
import struct
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "reference"))
try:
    import btfc_reference
except ImportError as missing:
    print(f"missing {missing.name}", flush=True)
    sys.exit(0)


def verdict(data):
    try:
        btfc_reference.check(io.BytesIO(data), None)
    except btfc_reference.Refusal as refusal:
        return f"{refusal.kind} {refusal.rule}"
    return "ok"


print("ready", flush=True)
while len(size := sys.stdin.buffer.read(4)) == 4:
    file = sys.stdin.buffer.read(struct.unpack("<I", size)[0])
    print(verdict(file), flush=True)
