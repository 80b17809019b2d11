#!/usr/bin/env python3
"""Bakes every mesh of every real scene at --resolution 128: the README's table, one row a scene.

    tests/bench/mesh_table.py [--fieldlight build/release/fieldlight] [--shared DIR] [--only NAME] [--all] [--readme README.md]

--all prints one row a mesh. --readme puts the table of scenes between the marks <!-- meshes --> and <!-- /meshes --> of that file.
Below the table stands what a bake of 327,680 triangles costs against OpenVDB's meshToVolume at the same width
(fieldlight_bake_bench, two threads, in turns; --no-speed leaves it out).

Errors are those that `bake` reports, in voxels: mean, P99, maximum. Exit code 1 where a mesh does not bake, where the mesh lies a
voxel or more off its field (a hole), where more than one sign in 10,000 differs from the exact winding number's, or where the
bake takes more than three times as long as OpenVDB's. Distances from the field to the mesh have no bound: where a solid has a
hole, its winding number closes it with a lid, which the tracer knows for what it is.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

from shared_scenes import add_shared_option, scene_files

MOST_MESH_ERROR = 1.0
MOST_WRONG_SIGNS = 1e-4
MOST_OPENVDB_TIMES = 3.0

# How the warnings of a bake begin or end, and the word that stands for each in the table.
WARNINGS = [("walls too thin", "thin walls"), ("sharp edges", "sharp edges"), ("no area", "faces without area"),
            ("same three vertices", "duplicate faces"), ("not finite", "faces not finite"), ("beyond the mesh", "bad indices")]

COLUMNS = ["scene", "meshes", "triangles", "seconds", "MB", "mesh to field", "field to mesh", "wrong signs", "worst mesh, warnings"]


def bake(program, scene, folder):
    """The report of one scene's bake and what failed in it."""
    done = subprocess.run([program, "bake", str(scene), "-o", str(folder), "--json", "--quiet", "--resolution", "128", "--force"],
                          capture_output=True, text=True)
    if not done.stdout:
        return None, [f"{done.stderr.strip()} (exit code {done.returncode})"]
    report = json.loads(done.stdout)
    failed = [f"mesh '{mesh['name']}': {mesh['error']}" for mesh in report["meshes"] if "error" in mesh]
    if done.returncode != 0 and not failed:
        failed = [f"exit code {done.returncode}"]
    report["meshes"] = [mesh for mesh in report["meshes"] if "error" not in mesh]
    return report, failed


def beyond_bounds(mesh):
    off, signs = mesh["error_voxels"]["max"], mesh["sign_mismatches"]
    if not off < MOST_MESH_ERROR:
        yield f"mesh '{mesh['name']}' lies {off:.3f} voxels off its field"
    if signs["wrong"] > MOST_WRONG_SIGNS * signs["samples"]:
        yield f"mesh '{mesh['name']}': {signs['wrong']} of {signs['samples']} signs are wrong"


def figures(error):
    return f"{error['mean']:.3f} {error['p99']:.2f} {error['max']:.2f}"


def remarks(meshes):
    """What the warnings are about, with the number of meshes that each is about where there are several."""
    found = []
    for key, word in WARNINGS:
        count = sum(any(key in warning for warning in mesh["warnings"]) for mesh in meshes)
        if count:
            found.append(word if len(meshes) == 1 else f"{word} ({count})")
    others = [warning for mesh in meshes for warning in mesh["warnings"] if not any(key in warning for key, _ in WARNINGS)]
    return found + others


def row_of(name, meshes, seconds, classes):
    worst = max(meshes, key=lambda mesh: mesh["error_voxels"]["p99"])
    signs = [sum(mesh["sign_mismatches"][key] for mesh in meshes) for key in ("wrong", "samples")]
    named = [f"`{worst['name']}`"] if len(meshes) > 1 else []
    return [name, classes, f"{sum(mesh['triangles'] for mesh in meshes):,}", f"{seconds:.1f}",
            f"{1e-6 * sum(mesh['bytes'] for mesh in meshes):.1f}", figures(worst["error_voxels"]),
            figures(worst["error_field_voxels"]), f"{signs[0]} of {signs[1]:,}" if signs[1] else "",
            "; ".join(named + remarks(meshes))]


def scene_row(name, report):
    counts = [(kind, sum(mesh["class"] == kind for mesh in report["meshes"])) for kind in ("solid", "sheet", "mixed")]
    classes = ", ".join(f"{count} {kind}" for kind, count in counts if count)
    return row_of(name, report["meshes"], report["seconds"], classes)


def mesh_rows(name, report):
    for mesh in report["meshes"]:
        yield row_of(f"{name} `{mesh['name']}`", [mesh], mesh["seconds"], mesh["class"])


def markdown(cells):
    return "| " + " | ".join(cells) + " |"


def measure_speed(program, rounds):
    """Median seconds of each baker, and the ratios of ours to the others', with failures."""
    done = subprocess.run([program, "--benchmark_format=json", f"--benchmark_repetitions={rounds}",
                           "--benchmark_min_time=0.01", "--benchmark_enable_random_interleaving=true"],
                          capture_output=True, text=True)
    if done.returncode != 0:
        return "", [f"{program}: {done.stderr.strip()}"]
    seconds, busy = {}, {}
    for row in json.loads(done.stdout)["benchmarks"]:
        if row["run_type"] == "iteration":
            baker = row["name"].split("/")[1]
            seconds.setdefault(baker, []).append(1e-3 * row["real_time"])
            busy.setdefault(baker, []).append(1e-3 * row["cpu_time"])
    # Each round by itself: what disturbs one of its rows mostly disturbs the others.
    def times(baker, of):
        return statistics.median(ours / theirs for ours, theirs in zip(of["ours"], of[baker]))
    text = "; ".join(f"{baker.replace('_', ', ')} {statistics.median(seconds[baker]):.2f} s "
                     f"({statistics.median(busy[baker]):.2f} s of processor time)" for baker in seconds)
    text = (f"Bake of 327,680 triangles, two threads, medians of {rounds} rounds in turns: {text}; ours takes "
            f"{times('openvdb', seconds):.2f} times the seconds of `meshToVolume` and {times('openvdb', busy):.2f} times its "
            f"processor time, {times('openvdb_unsigned', seconds):.2f} and {times('openvdb_unsigned', busy):.2f} without its signs.")
    least = min(times("openvdb", seconds), times("openvdb", busy))
    return text, [f"the bake takes {least:.2f} times as long as OpenVDB's"] if least > MOST_OPENVDB_TIMES else []


def write_between_marks(path, lines):
    text = path.read_text()
    begin, end = "<!-- meshes -->", "<!-- /meshes -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise SystemExit(f"{path} lacks {begin} and {end}")
    before, after = text.split(begin)[0], text.split(end)[1]
    path.write_text(before + begin + "\n" + "\n".join(lines) + "\n" + end + after)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fieldlight", default="build/release/fieldlight")
    add_shared_option(parser)
    parser.add_argument("--only", help="one scene's folder name")
    parser.add_argument("--all", action="store_true", help="one row a mesh")
    parser.add_argument("--readme", help="file that gets the table of scenes")
    parser.add_argument("--no-speed", action="store_true")
    parser.add_argument("--rounds", type=int, default=5, help="of the comparison with OpenVDB")
    options = parser.parse_args()
    failures, lines, mesh_count, scene_count = [], [markdown(COLUMNS), "|" + "---|" * len(COLUMNS)], 0, 0
    print("\n".join(lines))
    with tempfile.TemporaryDirectory() as folder:
        for name, scene in scene_files(options.shared):
            if options.only and name != options.only:
                continue
            report, failed = bake(options.fieldlight, scene, pathlib.Path(folder) / name)
            failures += [f"{name}: {line}" for line in failed]
            if not report or not report["meshes"]:
                continue
            failures += [f"{name}: {line}" for mesh in report["meshes"] for line in beyond_bounds(mesh)]
            mesh_count += len(report["meshes"])
            scene_count += 1
            lines.append(markdown(scene_row(name, report)))
            print("\n".join(map(markdown, mesh_rows(name, report))) if options.all else lines[-1], flush=True)
    lines.append(f"\n{mesh_count} meshes of {scene_count} scenes bake.")
    if not options.no_speed:
        program = pathlib.Path(options.fieldlight).parent / "tests" / "fieldlight_bake_bench"
        speed, slow = measure_speed(str(program), options.rounds)
        lines[-1] += " " + speed
        failures += slow
    print(lines[-1])
    if scene_count == 0:
        failures.append(f"no scene '{options.only}'" if options.only else "no scenes")
    for failure in failures:
        print("FAILED", failure)
    if options.readme and not options.only and not failures:
        write_between_marks(pathlib.Path(options.readme), lines)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
