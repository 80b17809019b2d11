#!/usr/bin/env python3
"""Renders the README's pictures, each through distance fields and through triangles, into assets/pictures.

    tests/bench/readme_pictures.py [--fieldlight build/release/fieldlight] [--shared DIR] [--only NAME]
        [--gather] [--markdown]

--markdown prints the README's table of pictures with their commands and renders nothing.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

from gather_common import REFERENCES, Runner, load_views

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMON = ["--size", "320x240", "--renderer", "path", "--spp", "64"]

# Views of --gather, and the EV100 of their pictures.
EXPOSURES = {"two_rooms": "3.5", "zdm2_level": "-0.5", "cornell_box": "5"}

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
    """gather | path at equal time | reference, each view at one exposure; names as gather_table.py's references."""
    run = Runner(options, folder)
    for view in load_views(options):
        pictures = {"gather": None, "path": None, "reference": run.reference(view)}
        pictures["gather"], stats = run.gather(view)
        pictures["path"], _ = run.path(view, "--spp", 1048576, "--time-budget", stats["seconds"]["render"])
        for kind, picture in pictures.items():
            subprocess.run([options.fieldlight, "convert", str(picture), str(target / f"{view['name']}.{kind}.png"),
                            "--exposure", EXPOSURES[view["name"]], "--quiet"], check=True)


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
    parser.add_argument("--size", default="640x360", help="of --gather")
    parser.add_argument("--reference-spp", type=int, default=2048, help="of the references of --gather")
    parser.add_argument("--cache", default=REFERENCES, help="keeps the references of --gather")
    parser.add_argument("--views", default=",".join(EXPOSURES), help="of --gather")
    parser.set_defaults(threads=0, frames=16)
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
