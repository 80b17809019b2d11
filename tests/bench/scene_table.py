#!/usr/bin/env python3
"""Renders every real scene through triangles and through distance fields, and prints one row a scene.

    tests/bench/scene_table.py --fieldlight build/release/fieldlight [--shared DIR] [--only NAME] [--json FILE]

Both pictures come from the same path tracer with the same numbers; only what the rays meet differs (--tracer and
--primary). Coverage is the mean of A, radiance the mean luminance. A scene passes if no pixel is non-finite, coverage
agrees within 1 % of the picture's pixels that either sees, and mean radiance within 10 %. Exit code 1 if a scene does not load or
render, or if one outside EXPECTED_DIFFERENCES does not pass.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from shared_scenes import add_shared_option, scene_files

# Scenes that the fields of today cannot show as triangles do, each with what was seen in the pictures.
EXPECTED_DIFFERENCES = {}

ARGUMENTS = ["--size", "256x256", "--renderer", "path", "--spp", "8", "--bounces", "2", "--quiet", "--resolution", "128"]


def render(program, scene, output, kind):
    stats = output.with_suffix(".json")
    command = [program, "render", str(scene), "-o", str(output), "--tracer", kind, "--primary", kind, "--png",
               "--stats", str(stats)] + ARGUMENTS
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        return None, done.stderr.strip()
    return json.loads(stats.read_text()), None


def means(program, picture):
    done = subprocess.run([program, "inspect", str(picture), "--json"], capture_output=True, text=True, check=True)
    channels = {channel["name"]: channel for channel in json.loads(done.stdout)["channels"]}
    luminance = sum(weight * channels[name]["mean"] for name, weight in (("R", 0.2126), ("G", 0.7152), ("B", 0.0722)))
    bad = sum(channel["nan"] + channel["inf"] for channel in channels.values())
    return channels["A"]["mean"], luminance, bad


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fieldlight", default="build/release/fieldlight")
    add_shared_option(parser)
    parser.add_argument("--only", help="one scene's folder name")
    parser.add_argument("--keep", help="folder to keep the pictures in")
    parser.add_argument("--json", help="write the rows to this file")
    options = parser.parse_args()
    rows, broken, outside = [], [], []
    print("| scene | coverage, triangles | coverage, fields | radiance, fields / triangles | bake s | render s, triangles | "
          "render s, fields | |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(options.keep or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name, scene in scene_files(options.shared):
            if options.only and name != options.only:
                continue
            pictures = {kind: folder / f"{name}.{kind}.exr" for kind in ("triangle", "sdf")}
            stats = {}
            for kind, picture in pictures.items():
                stats[kind], error = render(options.fieldlight, scene, picture, kind)
                if error:
                    broken.append(f"{name}, {kind}: {error}")
            if None in stats.values():
                print(f"| {name} | | | | | | | does not render |")
                continue
            coverage, radiance, bad = means(options.fieldlight, pictures["triangle"])
            sdf_coverage, sdf_radiance, sdf_bad = means(options.fieldlight, pictures["sdf"])
            ratio = sdf_radiance / radiance if radiance > 0 else 1.0
            good = bad + sdf_bad == 0 and abs(sdf_coverage - coverage) <= 0.01 * max(coverage, sdf_coverage) and \
                abs(ratio - 1) <= 0.1
            if bad + sdf_bad:
                broken.append(f"{name}: {bad + sdf_bad} non-finite values")
            remark = "" if good else EXPECTED_DIFFERENCES.get(name, "outside the bounds")
            if not good and name not in EXPECTED_DIFFERENCES:
                outside.append(name)
            rows.append({"scene": name, "coverage": coverage, "sdf_coverage": sdf_coverage, "radiance_ratio": ratio,
                         "good": good, "bake_seconds": stats["sdf"]["seconds"]["bake"],
                         "triangle_seconds": stats["triangle"]["seconds"]["render"],
                         "sdf_seconds": stats["sdf"]["seconds"]["render"]})
            row = rows[-1]
            print(f"| {name} | {coverage:.4f} | {sdf_coverage:.4f} | {ratio:.3f} | {row['bake_seconds']:.1f} | "
                  f"{row['triangle_seconds']:.1f} | {row['sdf_seconds']:.1f} | {remark} |", flush=True)
    within = sum(row["good"] for row in rows)
    print(f"\n{len(rows)} scenes rendered through both, {within} within the bounds, "
          f"{len(rows) - within - len(outside)} expected outside, {len(outside)} unexpectedly outside")
    for line in broken + [f"unexpectedly outside: {name}" for name in outside]:
        print(line)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(rows, indent=1))
    return 1 if broken or outside else 0


if __name__ == "__main__":
    sys.exit(main())
