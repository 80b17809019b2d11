#!/usr/bin/env python3
"""Renders the README's pictures, each through distance fields and through triangles, into assets/pictures.

    tests/bench/readme_pictures.py [--fieldlight build/release/fieldlight] [--shared DIR] [--only NAME]
        [--gather] [--markdown]

--markdown prints the README's table of pictures with their commands and renders nothing.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMON = ["--size", "320x240", "--renderer", "path", "--spp", "64"]

GATHER_VIEWS = ("cornell_box", "two_rooms", "living_room_godot")

# name, scene ({shared} is $FIELDLIGHT_SHARED), further flags
PICTURES = [
    ("cornell_box", "assets/cornell_box.glb", ["--bounces", "6"]),
    ("two_rooms", "assets/two_rooms.glb", ["--bounces", "6", "--sky", "1500,1900,2600"]),
    ("instances", "assets/instances.glb", ["--bounces", "3", "--sky", "3000,4000,6000"]),
    ("glossy", "assets/glossy.glb", ["--bounces", "6"]),
    ("flight_helmet", "{shared}/scenes/flight_helmet/FlightHelmet.gltf",
     ["--bounces", "3", "--sky", "{shared}/scenes/skies/spiaggia_di_mondello_1k.hdr", "--resolution", "256"]),
    ("menger_sponge", "{shared}/scenes/menger_sponge3/mengerSponge3.glb",
     ["--bounces", "4", "--sky", "300,400,600", "--sun", "30,50,20000", "--resolution", "256"]),
]


def command(program, entry, kind, output, shared):
    _, scene, flags = entry
    words = [program, "render", scene, "-o", str(output), "--tracer", kind, "--primary", kind, "--png"] + COMMON + flags
    return [word.replace("{shared}", shared) for word in words]


def render_gather(options, target, folder):
    """gather | path at equal time | reference, of GATHER_VIEWS."""
    views = json.loads((ROOT / "tests/images/views.json").read_text())["views"]
    for view in views:
        if view["name"] not in GATHER_VIEWS or options.only not in (None, view["name"]):
            continue
        scene = view["scene"].replace("shared:", options.shared + "/")
        seconds = None
        for kind in ("gather", "path", "reference"):
            cached = pathlib.Path(options.cache) / f"picture.{view['name']}.{options.size}.{options.spp}.png"
            picture = target / f"{view['name']}.{kind}.png"
            if kind == "reference" and cached.exists():
                picture.write_bytes(cached.read_bytes())
                continue
            output = pathlib.Path(folder) / f"{view['name']}.{kind}.exr"
            flags = {"gather": ["--renderer", "gather", "--accumulate", "16"],
                     "path": ["--renderer", "path", "--spp", "1048576", "--time-budget", str(seconds)],
                     "reference": ["--renderer", "path", "--spp", str(options.spp), "--seed", "987654"]}[kind]
            stats = output.with_suffix(".json")
            subprocess.run([options.fieldlight, "render", scene, "-o", str(output), "--png", "--size", options.size,
                            "--tracer", "triangle", "--bounces", "1", "--quiet", "--stats", str(stats)] +
                           view["camera"] + view["light"] + flags, check=True, cwd=ROOT)
            seconds = seconds or json.loads(stats.read_text())["seconds"]["render"]
            picture.write_bytes(output.with_suffix(".png").read_bytes())
            if kind == "reference":
                cached.parent.mkdir(parents=True, exist_ok=True)
                cached.write_bytes(picture.read_bytes())


def markdown():
    print("| distance fields | triangles |")
    print("|---|---|")
    for entry in PICTURES:
        name = entry[0]
        print(f"| ![{name}, fields](assets/pictures/{name}.sdf.png) | "
              f"![{name}, triangles](assets/pictures/{name}.triangle.png) |")
    print("\n<details><summary>The commands</summary>\n\n```sh")
    for entry in PICTURES:
        print(" ".join(command("fieldlight", entry, "sdf", f"{entry[0]}.exr", "$FIELDLIGHT_SHARED")))
    print("```\n\nThe right-hand column is the same with `--tracer triangle --primary triangle`. "
          "`tests/bench/readme_pictures.py` runs them all.\n</details>")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fieldlight", default=str(ROOT / "build/release/fieldlight"))
    parser.add_argument("--shared", default=os.environ.get("FIELDLIGHT_SHARED", str(ROOT.parent / "shared")))
    parser.add_argument("--only")
    parser.add_argument("--gather", action="store_true", help="the pictures of the gather's proofs instead")
    parser.add_argument("--size", default="400x300", help="of --gather")
    parser.add_argument("--spp", type=int, default=4096, help="of the references of --gather")
    parser.add_argument("--cache", default="/tmp/fieldlight_references", help="keeps the references of --gather")
    parser.add_argument("--target", default=str(ROOT / "assets/pictures"), help="folder of the pictures")
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    if options.markdown:
        markdown()
        return 0
    target = pathlib.Path(options.target)
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        if options.gather:
            render_gather(options, target, folder)
            return 0
        for entry in PICTURES:
            if options.only and options.only != entry[0]:
                continue
            for kind in ("triangle", "sdf"):
                output = pathlib.Path(folder) / f"{entry[0]}.{kind}.exr"
                subprocess.run(command(options.fieldlight, entry, kind, output, options.shared), check=True, cwd=ROOT)
                (target / f"{entry[0]}.{kind}.png").write_bytes(output.with_suffix(".png").read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main())
