#!/usr/bin/env python3
"""A bill of materials against what cargo builds: every crate is in it, with its version and its checksum.

    sbom.py FILE.cdx.json PACKAGE EDGES [CARGO TREE'S OPTIONS]

EDGES is normal,build, or normal for another target: what only builds is then this machine's.
"""

import json
import re
import subprocess
import sys


def main() -> int:
    path, package, edges, *options = sys.argv[1:]
    with open(path) as file:
        bill = json.load(file)
    listed = {(one["name"], one["version"]) for one in bill["components"]}
    listed.add((bill["metadata"]["component"]["name"], bill["metadata"]["component"]["version"]))
    command = ["cargo", "tree", "--locked", "-p", package, "-e", edges, "--prefix", "none", *options]
    tree = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    built = {tuple(match) for match in re.findall(r"^(\S+) v(\S+)", tree, re.MULTILINE)}
    for name, version in sorted(built - listed):
        print(f"{path}: {name} {version} is built and not listed")
    foreign = [
        one
        for one in bill["components"]
        if one["purl"].startswith("pkg:cargo/") and "download_url" not in one["purl"]
    ]
    unsigned = [one["name"] for one in foreign if not one.get("hashes")]
    for name in unsigned:
        print(f"{path}: {name} has no checksum")
    print(f"{path}: {len(listed)} crates listed, {len(built)} built")
    return 1 if built - listed or unsigned else 0


if __name__ == "__main__":
    sys.exit(main())
