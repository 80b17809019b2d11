#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets: small valid files, one for each thing that a reader treats differently.

Usage: make_seeds.py [TARGET...]

Every seed goes to corpus/TARGET/seed_NAME; seeds that are no longer made are removed. Inputs that a fuzzer found lie beside
them under other names and are left alone. fuzz_replay_test demands that every seed is accepted.
"""

import importlib
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
TARGETS = ("gltf", "image", "mesh", "vdb")


def main(names):
    for target in names or TARGETS:
        folder = HERE / "corpus" / target
        folder.mkdir(parents=True, exist_ok=True)
        made = {f"seed_{name}": data for name, data in importlib.import_module(f"seeds.{target}").seeds()}
        for old in folder.glob("seed_*"):
            if old.name not in made:
                old.unlink()
        for name, data in made.items():
            (folder / name).write_bytes(data)
        print(f"{target}: {len(made)} seeds, {sum(map(len, made.values()))} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
