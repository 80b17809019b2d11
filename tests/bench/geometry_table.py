#!/usr/bin/env python3
"""Hits through distance fields against hits on triangles, ray by ray, for every real scene: the README's table.

    tests/bench/geometry_table.py [--program build/release/tests/fieldlight_geometry] [--shared DIR] [--rays N]

The same isotropic random lines go through both tracers at --resolution 128. Of the scenes whose meshes are all closed, under 1 % of
the rays that hit in either may disagree, and the 99th percentile of |dt| (n.d) beyond one voxel from silhouettes must
stay under half a voxel; exit code 1 where one does not.
"""

import argparse
import json
import pathlib
import subprocess
import sys

from shared_scenes import add_shared_option, scene_files

# "closed" in the topology column of ../shared/scenes/README.md.
CLOSED = {"irradiance_volume_bevy", "volumetric_fog_room_bevy", "orientation_test", "scallop", "menger_sponge3",
          "self_intersect_a", "hourglass_nonmanifold_vertex", "box_interleaved", "box_with_spaces",
          "recursive_skeletons"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/release/tests/fieldlight_geometry")
    parser.add_argument("--fieldlight", help="the program beside which --program is found")
    add_shared_option(parser)
    parser.add_argument("--rays", type=int, default=1_000_000)
    options = parser.parse_args()
    program = options.program
    if options.fieldlight:
        program = str(pathlib.Path(options.fieldlight).parent / "tests" / "fieldlight_geometry")
    print("| scene | closed | disagree % | beyond a voxel % | dt p50 | dt p99 | dt max | p99 beyond a voxel | normal, degrees "
          "| steps | Mrays/s triangles, fields |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    failures = []
    for name, scene in scene_files(options.shared):
        done = subprocess.run([program, str(scene), "--resolution", "128", "--rays", str(options.rays), "--json"],
                              capture_output=True, text=True)
        if done.returncode != 0:
            failures.append(f"{name}: {done.stderr.strip()}")
            continue
        row = json.loads(done.stdout)
        closed = name in CLOSED
        raw, far = row["raw_voxels"], row["beyond_silhouettes_voxels"]
        print(f"| {name} | {'yes' if closed else ''} | {row['disagree_percent']:.2f} | "
              f"{row['disagree_beyond_silhouettes_percent']:.3f} | {raw['p50']:.3f} | {raw['p99']:.2f} | {raw['max']:.1f} | "
              f"{far['p99']:.3f} | {row['normal_degrees']:.1f} | {row['steps']:.1f} | "
              f"{row['triangle_mrays']:.1f}, {row['sdf_mrays']:.1f} |", flush=True)
        if closed and (row["disagree_percent"] >= 1.0 or far["p99"] >= 0.5):
            failures.append(f"{name}: {row['disagree_percent']:.2f} % disagree, p99 {far['p99']:.3f} voxels")
    for failure in failures:
        print("FAILED", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
