#!/usr/bin/env python3
"""Serves a folder to browsers.

    samples/web/serve.py FOLDER [--host HOST] [--port PORT]

Prints the address once it listens. Port 0 takes a free one. Pages may only load files of this server.
"""
from __future__ import annotations

import argparse
import contextlib
import functools
import http.server
import os
from typing import Any

POLICY = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; " \
    "connect-src 'self' data: blob:; frame-ancestors 'none'"


class Files(http.server.SimpleHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    extensions_map = http.server.SimpleHTTPRequestHandler.extensions_map | {
        ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm", ".glb": "model/gltf-binary"}

    def send_response(self, code: int, message: str | None = None) -> None:
        self.code = code
        super().send_response(code, message)

    def copyfile(self, source: Any, outputfile: Any) -> None:
        with contextlib.suppress(ConnectionError):  # the client is gone
            super().copyfile(source, outputfile)

    def end_headers(self) -> None:
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        # Long enough for workers to find what the page has loaded for them, but no longer, because files change.
        self.send_header("Cache-Control", "max-age=5" if self.code == 200 else "no-cache")
        super().end_headers()

    def log_message(self, *_: object) -> None:
        pass


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    options = parser.parse_args()
    if not os.path.isdir(options.folder):
        parser.exit(2, f"samples/web/serve.py: there is no folder {options.folder}\n")
    try:
        server = http.server.ThreadingHTTPServer((options.host, options.port), functools.partial(Files, directory=options.folder))
    except OSError as error:
        parser.exit(1, f"samples/web/serve.py: cannot listen at port {options.port}: {error.strerror}\n")
    print(f"http://{options.host}:{server.server_address[1]}/", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
