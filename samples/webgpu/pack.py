#!/usr/bin/env python3
"""Packs a file of 32-bit words for the page, by gzip: all lowest bytes first, then the next, and so on, because alike bytes pack
better.

    samples/webgpu/pack.py FILE.words PACKED.gz
"""
import gzip
import sys

with open(sys.argv[1], "rb") as file:
    words = file.read()
packed = gzip.compress(b"".join(words[i::4] for i in range(4)), 9, mtime=0)
with open(sys.argv[2], "wb") as file:
    file.write(packed)
