#!/usr/bin/env python3
"""Is the path tracer right, and is it quick? Renders scenes of assets/ with it and with Blender's Cycles, and compares.

Usage: compare_cycles.py [--fieldlight PROGRAM] [--out FOLDER] [--case NAME]... [--scale S]

Needs blender (3.4) and numpy. Each case renders the same file with both, several seeds, in turns, so that a busy
machine slows both. Checked are, where a case asks for it:
  mean        the mean radiance of the two, channel by channel, within the case's tolerance
  structure   the difference picture in blocks of 8x8, with the scatter of the seeds as variance: every block passes
              Welch's test (1 % for all together, Sidak), and neighbouring blocks do not correlate beyond 4 standard errors
  variance    the Variance layer against the scatter of the seeds
  metals      the mean radiance on the pixels of each metal
  speed       samples a second at the same bounces and threads; relMSE at equal time
Times are of rendering alone: a picture of one sample is subtracted on both sides. Wall time decides on a quiet
machine; where other programs take more than 5 % of it, processor time does. Exit code: 0 if all hold, 1 otherwise.
FOLDER holds report.json with all numbers, and difference.png by case: ours, Cycles, ours - Cycles (red, blue: +- 10 %).
"""

import argparse
import json
import os
import pathlib
import resource
import struct
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ASSETS = HERE.parent.parent / "assets"

try:
    import numpy
except ImportError:  # A Python of one's own before Debian's, which has numpy.
    if sys.executable == "/usr/bin/python3":
        raise
    os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])

sys.path.insert(0, str(HERE))
from block_test import structure_of  # noqa: E402
from difference_picture import LUMINANCE, write_difference  # noqa: E402
from exr_pixels import read_exr, rgb  # noqa: E402

THREADS = 2
ROUNDS = 3
QUIET = 0.05
WALL, PROCESSOR = 0, 1

# Samples are those of one seed; bounces -1 is without limit. For "glossy" the plastics are made Lambert in both, since
# Blender 3.4 has no equal of glTF's dielectric. Its metals differ too: Smith's shadowing and masking uncorrelated (glTF:
# correlated), a Fresnel term remapped from a dielectric's (glTF: Schlick's).
CASES = {
    "cornell_box": dict(scene="cornell_box", size=(512, 512), samples=16, seeds=12, bounces=4, speed=True),
    "cornell_box_8": dict(scene="cornell_box", size=(512, 512), samples=16, seeds=6, bounces=8, speed=True),
    "cornell_box_direct": dict(scene="cornell_box", size=(256, 256), samples=16, seeds=12, bounces=0, variance=True),
    "cornell_box_unlimited": dict(scene="cornell_box", size=(256, 256), samples=16, seeds=12, bounces=-1),
    "two_rooms": dict(scene="two_rooms", size=(320, 180), samples=64, seeds=12, bounces=6, variance=True),
    "two_rooms_sky": dict(scene="two_rooms", camera="back room", size=(320, 180), samples=48, seeds=12, bounces=6,
                          sky=(1500.0, 1900.0, 2600.0)),
    "glossy_metals": dict(scene="glossy", size=(320, 240), samples=64, seeds=6, bounces=4, tolerance=0.03,
                          plastics_to_lambert=True, structure=False),
}


def read_glb(path):
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + length]), data[20 + length:]


def write_glb(path, document, rest):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<III", 0x46546C67, 2, 20 + len(text) + len(rest))
    path.write_bytes(head + struct.pack("<II", len(text), 0x4E4F534A) + text + rest)


def scene_file(case, folder):
    """The case's GLB; where asked, with dielectrics made Lambert."""
    source = ASSETS / (case["scene"] + ".glb")
    if not case.get("plastics_to_lambert"):
        return source
    document, rest = read_glb(source)
    document["extensionsUsed"] = sorted({*document["extensionsUsed"], "KHR_materials_specular"})
    for material in document["materials"]:
        if material["pbrMetallicRoughness"]["metallicFactor"] == 0.0:
            material.setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0.0}
    path = folder / (case["scene"] + "_lambert.glb")
    write_glb(path, document, rest)
    return path


def run(command, log, environment=None):
    with open(log, "w") as file:
        if subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, env=environment).returncode != 0:
            sys.exit(f"failed: {' '.join(map(str, command))}\n{pathlib.Path(log).read_text()[-2000:]}")


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class OtherLoad:
    """The share of the machine's processors that went to others than this script's children."""

    def __init__(self):
        self.wall, self.children, self.all = time.perf_counter(), children_seconds(), self.busy_seconds()

    @staticmethod
    def busy_seconds():
        with open("/proc/stat") as file:
            # user nice system idle iowait irq softirq steal
            ticks = [int(word) for word in file.readline().split()[1:9]]
        return (sum(ticks) - ticks[3] - ticks[4]) / os.sysconf("SC_CLK_TCK")

    def share(self):
        others = self.busy_seconds() - self.all - (children_seconds() - self.children)
        return max(0.0, others / (time.perf_counter() - self.wall) / os.cpu_count())


def render_cycles(case, scene, folder, seeds):
    """Pictures, and (wall, processor) seconds a sample."""
    prefix = folder / f"cycles.{seeds[0]}"
    job = {"scene": str(scene), "camera": case.get("camera"), "size": case["size"], "samples": case["samples"],
           "bounces": case["bounces"], "sky": list(case.get("sky", (0.0, 0.0, 0.0))), "threads": THREADS,
           "seeds": seeds, "output": str(prefix)}
    job_file = folder / f"cycles.{seeds[0]}.job.json"
    job_file.write_text(json.dumps(job))
    # Blender takes its Python modules from the first python3 on the path: Debian's, not one of somebody's own.
    run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
         HERE / "render_cycles.py", "--", job_file], folder / "cycles.log", {**os.environ, "PATH": "/usr/bin:/bin"})
    costs = json.loads(pathlib.Path(str(prefix) + ".json").read_text())
    pictures = [rgb(read_exr(f"{prefix}.{seed}.exr")) for seed in seeds]
    return pictures, per_sample(costs["renders"], costs["one_sample"], case["samples"])


def per_sample(renders, one_sample, samples):
    return [(numpy.array(seconds) - numpy.min(one_sample, axis=0)) / (samples - 1) for seconds in renders]


def render_once(program, case, scene, folder, samples, seed, layers):
    """Channels, and (wall, processor) seconds; the latter with loading and writing."""
    output, stats = folder / f"ours.{seed}.exr", folder / f"ours.{seed}.json"
    sky = ",".join(map(str, case["sky"])) if "sky" in case else "none"
    command = [program, "render", scene, "-o", output, "--renderer", "path", "--tracer", "triangle", "--primary",
               "triangle", "--size", "{}x{}".format(*case["size"]), "--spp", str(samples), "--sky", sky, "--seed",
               str(seed), "--threads", str(THREADS), "--aov", layers, "--stats", stats, "--quiet"]
    if case["bounces"] >= 0:
        command += ["--bounces", str(case["bounces"])]
    if case.get("camera"):
        command += ["--camera", case["camera"]]
    before = children_seconds()
    run(command, folder / "ours.log")
    processor = children_seconds() - before
    return read_exr(output), (json.loads(stats.read_text())["seconds"]["render"], processor)


def render_ours(program, case, scene, folder, seeds):
    """Channels of each seed, and (wall, processor) seconds a sample."""
    one_sample = [render_once(program, case, scene, folder, 1, seed, "Albedo")[1] for seed in (1001, 1002)]
    # The layer costs stratification, since its batches are independent: a picture to be judged goes without.
    layers = "Variance,Albedo" if case.get("variance") else "Albedo"
    results = [render_once(program, case, scene, folder, case["samples"], seed, layers) for seed in seeds]
    return [r[0] for r in results], per_sample([r[1] for r in results], one_sample, case["samples"])


def relative_mse(pictures, others):
    """Mean over the pictures of relMSE = mean((I - R)^2 / (R^2 + 0.01)); R, which is neutral, is the mean of all others."""
    total, count = sum(pictures) + sum(others), len(pictures) + len(others)
    errors = []
    for picture in pictures:
        reference = (total - picture) / (count - 1)
        errors.append(((picture - reference) ** 2 / (reference ** 2 + 0.01)).mean())
    # The noise of R adds about 1 / (count - 1) of a picture's variance.
    return float(numpy.mean(errors)) * (count - 1) / count


def metal_means(document, albedo, ours, theirs):
    """Mean radiance, ours over Cycles's, on the pixels of each metal. Albedo is a metal's base colour on whole pixels."""
    result = {}
    for material in document["materials"]:
        pbr = material["pbrMetallicRoughness"]
        name = material["name"].split()[0]
        if pbr["metallicFactor"] == 1.0 and name not in result:
            on = (abs(albedo - numpy.array(pbr["baseColorFactor"][:3])) < 0.004).all(axis=-1)
            if on.sum() > 100:
                result[name] = float(ours[on].mean() / theirs[on].mean())
    return result


def compare(program, name, case, folder):
    folder.mkdir(parents=True, exist_ok=True)
    scene = scene_file(case, folder)
    load = OtherLoad()
    ours, theirs, variances, our_costs, their_costs = [], [], [], [], []
    for part in range(ROUNDS):
        seeds = list(range(1 + part, 1 + case["seeds"], ROUNDS))
        pictures, costs = render_cycles(case, scene, folder, seeds)
        theirs += pictures
        their_costs += costs
        channels, costs = render_ours(program, case, scene, folder, seeds)
        ours += [rgb(c) for c in channels]
        if case.get("variance"):
            variances += [rgb(c, "Variance") for c in channels]
        our_costs += costs
    others = load.share()

    ours, theirs = numpy.stack(ours), numpy.stack(theirs)
    write_difference(folder / "difference.png", ours.mean(axis=0), theirs.mean(axis=0))
    means = ours.mean(axis=(1, 2)), theirs.mean(axis=(1, 2))
    ratio = means[0].mean(axis=0) / means[1].mean(axis=0)
    error = ratio * sum(m.var(axis=0, ddof=1) / len(m) / m.mean(axis=0) ** 2 for m in means) ** 0.5
    cost = numpy.median(our_costs, axis=0), numpy.median(their_costs, axis=0)
    pixel_count = case["size"][0] * case["size"][1]
    clock = WALL if others < QUIET else PROCESSOR
    mse = relative_mse(ours, theirs), relative_mse(theirs, ours)
    report = {"case": name, "bounces": case["bounces"], "size": case["size"], "samples": case["samples"],
              "seeds": case["seeds"], "mean_ratio": list(ratio), "mean_ratio_standard_error": list(error),
              "structure": structure_of(ours @ LUMINANCE, theirs @ LUMINANCE),
              "other_load": others, "clock": ("wall", "processor")[clock],
              "samples_per_wall_second": [pixel_count / c[WALL] for c in cost],
              "samples_per_processor_second": [pixel_count / c[PROCESSOR] for c in cost],
              "relative_mse": mse,
              # The error of both falls as 1 / time: noise is all there is, as the other checks show.
              "relative_mse_at_equal_time": mse[0] / mse[1] * cost[0][clock] / cost[1][clock]}
    tolerance = case.get("tolerance", 0.01)
    checks = {"mean": all(abs(ratio - 1.0) < tolerance) and all(error < tolerance / 3.0)}
    if case.get("variance"):
        report["variance_layer_over_scatter"] = float(numpy.mean(variances) / ours.var(axis=0, ddof=1).mean())
        # Variances have heavy tails: their mean is itself uncertain by some ten per cent.
        checks["variance"] = 0.7 < report["variance_layer_over_scatter"] < 1.4
    if case.get("structure", True):
        checks["structure"] = report["structure"]["pass"] == 1.0 and abs(report["structure"]["neighbours"]) < 4.0
    if case.get("plastics_to_lambert"):
        albedo = rgb(channels[0], "Albedo")
        report["metals"] = metal_means(read_glb(scene)[0], albedo, ours.mean(axis=0), theirs.mean(axis=0))
        checks["metals"] = len(report["metals"]) == 3 and all(abs(r - 1.0) < 0.03 for r in report["metals"].values())
    if case.get("speed"):
        checks["samples a second"] = cost[0][clock] <= cost[1][clock]
        checks["relMSE at equal time"] = report["relative_mse_at_equal_time"] <= 1.0
    report["checks"] = {key: bool(value) for key, value in checks.items()}
    return report


def describe(report):
    found = report["structure"]
    bounces = "all" if report["bounces"] < 0 else report["bounces"]
    lines = ["{}: {}x{}, {} bounces, {} seeds of {} samples".format(
                 report["case"], *report["size"], bounces, report["seeds"], report["samples"]),
             "  mean radiance, ours / Cycles   " + "  ".join(
                 f"{r:.4f} +- {e:.4f}" for r, e in zip(report["mean_ratio"], report["mean_ratio_standard_error"])),
             f"  blocks of 8x8 that pass        {100 * found['pass']:.2f} % of {found['blocks']}; z rms {found['rms_z']:.3f}, "
             f"worst {found['worst_z']:.2f} of {found['limit']:.2f} (differs by {100 * found['worst_difference']:.2f} %); "
             f"rms difference {100 * found['rms_difference']:.2f} %; neighbours {found['neighbours']:+.1f} standard errors"]
    if "variance_layer_over_scatter" in report:
        lines.append(f"  Variance layer / scatter       {report['variance_layer_over_scatter']:.3f}")
    if "metals" in report:
        lines.append("  metals, ours / Cycles          " +
                     ", ".join(f"{name} {ratio:.4f}" for name, ratio in report["metals"].items()))
    for clock in ("wall", "processor"):
        a, b = report[f"samples_per_{clock}_second"]
        lines.append(f"  Msamples a {clock + ' second':<19} ours {a / 1e6:.3f}, Cycles {b / 1e6:.3f}: {a / b:.2f} x")
    a, b = report["relative_mse"]
    lines.append(f"  relMSE at equal samples        ours {a:.5f}, Cycles {b:.5f}: {a / b:.2f} x; at equal time "
                 f"{report['relative_mse_at_equal_time']:.2f} x ({report['clock']} time; others took "
                 f"{100 * report['other_load']:.0f} % of the machine)")
    lines.append("  " + ", ".join(f"{key}: {'ok' if good else 'FAILED'}" for key, good in report["checks"].items()))
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fieldlight", default="build/release/fieldlight", type=pathlib.Path)
    parser.add_argument("--out", default="out/cycles", type=pathlib.Path)
    parser.add_argument("--case", action="append", choices=list(CASES), help="default: all")
    parser.add_argument("--scale", default=1.0, type=float, help="multiplies the samples of each case")
    options = parser.parse_args()
    begin = time.perf_counter()
    reports = []
    for name in options.case or CASES:
        # The Variance layer needs its eight batches.
        case = {**CASES[name], "samples": max(8, round(CASES[name]["samples"] * options.scale))}
        reports.append(compare(options.fieldlight.resolve(), name, case, options.out.resolve() / name))
        print(describe(reports[-1]), flush=True)
    (options.out / "report.json").write_text(json.dumps(reports, indent=2) + "\n")
    failed = [f"{r['case']} ({key})" for r in reports for key, good in r["checks"].items() if not good]
    print(f"{time.perf_counter() - begin:.0f} s; " + (f"FAILED: {', '.join(failed)}" if failed else "all hold"))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
