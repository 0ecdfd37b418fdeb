#!/usr/bin/env python3
"""The dependencies' licences and sources, against deny.toml: the two checks of `cargo deny` that matter here.

    Cargo.lock ─▶ cargo metadata ─▶ licence expression  ─▶ in [licenses] allow?
                                    source              ─▶ crates.io, or a path of this repository?

cargo-deny itself says the same and more, but building it takes longer than all other checks of a step.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"


def allowed(expression: str, licences: set[str]) -> bool:
    """Whether an SPDX expression can be met with `licences`: AND binds closer than OR; "/" is an old OR."""
    parts = re.findall(r"\(|\)|[^\s()]+(?: WITH [^\s()]+)?", expression.replace("/", " OR "))
    words = {"AND": "and", "OR": "or", "(": "(", ")": ")"}
    return bool(
        eval(" ".join(words.get(part, str(part in licences)) for part in parts), {"__builtins__": {}})
    )


def problems(package: dict, licences: set[str]) -> list[str]:
    found = []
    name = f"{package['name']} {package['version']}"
    if package["source"] not in (None, CRATES_IO):
        found.append(f"{name}: comes from {package['source']}")
    if not package["license"]:
        found.append(f"{name}: names no licence")
    elif not allowed(package["license"], licences):
        found.append(f"{name}: {package['license']} is not in deny.toml")
    if package["source"] is None:
        for dependency in package["dependencies"]:
            if dependency["req"] == "*" and dependency["path"] is None:
                found.append(f"{name}: any version of {dependency['name']} will do")
    return found


def main() -> int:
    licences = set(tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]["allow"])
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--all-features"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)[
        "packages"
    ]
    found = [problem for package in packages for problem in problems(package, licences)]
    print(f"{len(packages)} packages, {len(found)} problems")
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
