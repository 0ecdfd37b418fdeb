#!/usr/bin/env python3
"""The crates that programs are made of, with their licences: packaging/third_party.py FILE.cdx.json..."""

import json
import sys


def licences(component):
    """Its licences, as it names them."""
    named = (
        each.get("expression") or each["license"].get("id") or each["license"].get("name")
        for each in component["licenses"]
    )
    return " AND ".join(named)


def main():
    crates = {}
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            for component in json.load(file)["components"]:
                # Without a licence none is handed out: cargo-deny has looked (deny.toml).
                crates[component["name"], component["version"]] = licences(component)
    print("# What kehai is made of\n")
    print("Each crate is at `https://crates.io/crates/NAME/VERSION`, with the text of its licence.\n")
    print("| crate | version | licence |\n|---|---|---|")
    for (name, version), licence in sorted(crates.items()):
        print(f"| {name} | {version} | {licence} |")


if __name__ == "__main__":
    main()
