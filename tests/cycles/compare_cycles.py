#!/usr/bin/env python3
"""Is the path tracer right, and is it quick? Renders scenes of assets/ with it and with Blender's Cycles, and compares.

Usage: compare_cycles.py --fieldlight PROGRAM [--out FOLDER] [--case NAME]... [--seeds N] [--scale S]

Needs blender (3.4) and numpy. For each case both render the same file with several seeds, in turns, so that a busy machine
slows both. The variance comes from the seeds. Checked are:
  mean        the mean radiance of the two, within the case's tolerance
  structure   the difference picture in blocks of 8x8: each block's z under the two-sided 1 % threshold for all
              blocks together (Sidak), and no correlation between neighbouring blocks beyond 4 standard errors
  variance    the Variance layer against the scatter of the seeds
  speed       samples a second at the same bounces and threads; relMSE at equal time (cases that ask for it)
Exit code: 0 if all hold, 1 otherwise. FOLDER/report.json has all numbers.
"""

import argparse
import json
import os
import pathlib
import resource
import struct
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ASSETS = HERE.parent.parent / "assets"

try:
    import numpy
except ImportError:  # A Python of one's own before Debian's, which has numpy.
    if sys.executable == "/usr/bin/python3":
        raise
    os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])

from statistics import NormalDist

sys.path.insert(0, str(HERE))
from exr_pixels import read_exr, rgb  # noqa: E402

THREADS = 2
BLOCK = 8
LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])

# Samples are those of one seed. Metals differ on purpose: Blender 3.4 has Smith's shadowing and masking
# uncorrelated and a Fresnel term of a dielectric mapped to the metal's colours, glTF has them correlated and Schlick's.
CASES = {
    "cornell_box": dict(scene="cornell_box", size=(512, 512), samples=32, bounces=4, speed=True),
    "cornell_box_all_bounces": dict(scene="cornell_box", size=(256, 256), samples=64, bounces=-1),
    "two_rooms": dict(scene="two_rooms", size=(320, 180), samples=192, bounces=6),
    "two_rooms_sky": dict(scene="two_rooms", camera="back room", size=(320, 180), samples=192, bounces=6,
                          sky=(1500.0, 1900.0, 2600.0)),
    "glossy_metals": dict(scene="glossy", size=(320, 240), samples=128, bounces=4, tolerance=0.03,
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
    """The case's GLB; where asked, with dielectrics made Lambert, since Blender has no equal of glTF's."""
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


def render_cycles(case, scene, folder, samples, seeds):
    """Pictures, and (wall, processor) seconds a sample."""
    prefix = folder / f"cycles.{seeds[0]}"
    job = {"scene": str(scene), "camera": case.get("camera"), "size": case["size"], "samples": samples,
           "bounces": case["bounces"], "sky": list(case.get("sky", (0.0, 0.0, 0.0))), "threads": THREADS,
           "seeds": seeds, "output": str(prefix)}
    job_file = folder / f"cycles.{seeds[0]}.job.json"
    job_file.write_text(json.dumps(job))
    # Blender takes its Python modules from the first python3 on the path: Debian's, not one of somebody's own.
    run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
         HERE / "blender_render.py", "--", job_file], folder / "cycles.log", {**os.environ, "PATH": "/usr/bin:/bin"})
    costs = json.loads(pathlib.Path(str(prefix) + ".json").read_text())
    pictures = [rgb(read_exr(f"{prefix}.{seed}.exr")) for seed in seeds]
    overhead = numpy.array(costs["one_sample"])
    return pictures, [(numpy.array(s) - overhead) / (samples - 1) for s in costs["renders"]]


def render_ours(program, case, scene, folder, samples, seed):
    """Picture, its Variance layer, and (wall, processor) seconds a sample."""
    output, stats = folder / f"ours.{seed}.exr", folder / f"ours.{seed}.json"
    sky = ",".join(map(str, case["sky"])) if "sky" in case else "none"
    command = [program, "render", scene, "-o", output, "--renderer", "path", "--tracer", "triangle", "--primary",
               "triangle", "--size", "{}x{}".format(*case["size"]), "--spp", str(samples), "--sky", sky, "--seed",
               str(seed), "--threads", str(THREADS), "--aov", "Variance,Albedo", "--stats", stats, "--quiet"]
    if case["bounces"] >= 0:
        command += ["--bounces", str(case["bounces"])]
    if case.get("camera"):
        command += ["--camera", case["camera"]]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(command, folder / "ours.log")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    channels = read_exr(output)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    seconds = numpy.array([json.loads(stats.read_text())["seconds"]["render"], processor]) / samples
    return rgb(channels), rgb(channels, "Variance"), rgb(channels, "Albedo"), seconds


def in_blocks(picture):
    height, width = (n // BLOCK * BLOCK for n in picture.shape)
    return picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).sum(axis=(1, 3))


def structure_of(ours, theirs):
    """z of each block of the difference of two stacks of luminance pictures [seed, height, width]."""
    difference = in_blocks(ours.mean(axis=0) - theirs.mean(axis=0))
    variance = in_blocks(ours.var(axis=0, ddof=1) / len(ours) + theirs.var(axis=0, ddof=1) / len(theirs))
    lit = variance > 0.0
    z = numpy.where(lit, difference / numpy.sqrt(numpy.where(lit, variance, 1.0)), 0.0)
    count = int(lit.sum())
    threshold = NormalDist().inv_cdf(1.0 - (1.0 - 0.99 ** (1.0 / count)) / 2.0)
    pairs = numpy.concatenate([(z[1:] * z[:-1])[lit[1:] & lit[:-1]], (z[:, 1:] * z[:, :-1])[lit[:, 1:] & lit[:, :-1]]])
    square = float((z[lit] ** 2).mean())
    return {"blocks": count, "rms_z": square ** 0.5, "worst_z": float(abs(z).max()), "threshold": threshold,
            "beyond_3": float((abs(z[lit]) > 3.0).mean()),
            "neighbour_z": float(pairs.mean() / square * len(pairs) ** 0.5),
            "dark_difference": float(abs(difference[~lit]).max(initial=0.0))}


def relative_mse(pictures, others):
    """Mean over the pictures of relMSE = mean((I - R)^2 / (R^2 + 0.01)); R is the mean of all but that picture."""
    total, count = sum(pictures) + sum(others), len(pictures) + len(others)
    errors = []
    for picture in pictures:
        reference = (total - picture) / (count - 1)
        # The noise of R adds its own variance, 1 / (count - 1) of a picture's where both are equally noisy.
        errors.append(((picture - reference) ** 2 / (reference ** 2 + 0.01)).mean())
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


def compare(program, name, case, folder, seed_count, scale):
    folder.mkdir(parents=True, exist_ok=True)
    scene = scene_file(case, folder)
    samples = max(8, round(case["samples"] * scale))
    ours, theirs, variances, our_costs, their_costs = [], [], [], [], []
    our_samples = samples
    seeds = list(range(1, seed_count + 1))
    for begin in range(0, seed_count, 2):
        pictures, costs = render_cycles(case, scene, folder, samples, seeds[begin:begin + 2])
        theirs += pictures
        their_costs += costs
        if case.get("speed") and begin == 0:
            # As many samples as fit into Cycles's time.
            trial = render_ours(program, case, scene, folder, samples, 1000)[3]
            our_samples = max(8, round(samples * costs[0][1] / trial[1]))
        for seed in seeds[begin:begin + 2]:
            picture, variance, albedo, cost = render_ours(program, case, scene, folder, our_samples, seed)
            ours.append(picture)
            variances.append(variance)
            our_costs.append(cost)

    pixel_count = case["size"][0] * case["size"][1]
    light_ours, light_theirs = numpy.stack(ours) @ LUMINANCE, numpy.stack(theirs) @ LUMINANCE
    means = light_ours.mean(axis=(1, 2)), light_theirs.mean(axis=(1, 2))
    ratio = means[0].mean() / means[1].mean()
    error = ratio * sum(m.var(ddof=1) / len(m) / m.mean() ** 2 for m in means) ** 0.5
    tolerance = case.get("tolerance", 0.01)
    report = {"case": name, "samples": [our_samples, samples], "seeds": seed_count,
              "mean_ratio": ratio, "mean_ratio_standard_error": error,
              "mean_ratio_by_channel": list(sum(ours).mean(axis=(0, 1)) / sum(theirs).mean(axis=(0, 1)))}
    scatter = numpy.stack(ours).var(axis=0, ddof=1).mean()
    report["variance_layer_over_scatter"] = float(numpy.mean(variances) / scatter)
    report["structure"] = structure_of(light_ours, light_theirs)
    our_cost, their_cost = numpy.median(our_costs, axis=0), numpy.median(their_costs, axis=0)
    report["samples_per_second"] = [pixel_count / our_cost[0], pixel_count / their_cost[0]]
    report["samples_per_processor_second"] = [pixel_count / our_cost[1], pixel_count / their_cost[1]]
    report["relative_mse"] = [relative_mse(ours, theirs), relative_mse(theirs, ours)]
    report["render_seconds"] = [our_cost[0] * our_samples, their_cost[0] * samples]
    if case.get("plastics_to_lambert"):
        report["metals"] = metal_means(read_glb(scene)[0], albedo, sum(ours), sum(theirs))

    checks = {"mean": abs(ratio - 1.0) < tolerance and error < tolerance / 3.0,
              # The mean of heavy-tailed variances is itself noisy: 8 seeds leave some ten per cent.
              "variance": 0.7 < report["variance_layer_over_scatter"] < 1.4}
    if case.get("structure", True):
        found = report["structure"]
        checks["structure"] = (found["worst_z"] < found["threshold"] and abs(found["neighbour_z"]) < 4.0 and
                               found["dark_difference"] == 0.0)
    if "metals" in report:
        checks["metals"] = len(report["metals"]) == 3 and all(abs(r - 1.0) < 0.03 for r in report["metals"].values())
    if case.get("speed"):
        checks["samples a second"] = report["samples_per_second"][0] >= report["samples_per_second"][1]
        ours_error, their_error = (e * s for e, s in zip(report["relative_mse"], report["render_seconds"]))
        checks["relMSE at equal time"] = ours_error <= their_error
    report["checks"] = {key: bool(value) for key, value in checks.items()}
    return report


def describe(report):
    found = report["structure"]
    lines = [f"{report['case']}: {report['seeds']} seeds of {report['samples'][0]} (ours) and {report['samples'][1]} "
             "(Cycles) samples",
             f"  mean radiance, ours / Cycles   {report['mean_ratio']:.4f} +- {report['mean_ratio_standard_error']:.4f}"
             f"   by channel {' '.join(f'{r:.4f}' for r in report['mean_ratio_by_channel'])}",
             f"  z of {found['blocks']} blocks of 8x8        rms {found['rms_z']:.3f}, worst {found['worst_z']:.2f} "
             f"(limit {found['threshold']:.2f}), beyond 3: {100 * found['beyond_3']:.2f} %, neighbours correlate by "
             f"{found['neighbour_z']:.1f} standard errors",
             f"  Variance layer / scatter       {report['variance_layer_over_scatter']:.3f}"]
    if "metals" in report:
        lines.append("  metals, ours / Cycles          " +
                     ", ".join(f"{name} {ratio:.4f}" for name, ratio in report["metals"].items()))
    for title, key in (("a second", "samples_per_second"), ("a processor second", "samples_per_processor_second")):
        a, b = report[key]
        lines.append(f"  Msamples {title:<21} ours {a / 1e6:.3f}, Cycles {b / 1e6:.3f} ({a / b:.2f} x)")
    (a, b), (s, t) = report["relative_mse"], report["render_seconds"]
    lines.append(f"  relMSE                         ours {a:.5f} in {s:.1f} s, Cycles {b:.5f} in {t:.1f} s "
                 f"(error x time: {a * s / (b * t):.2f} x)")
    lines.append("  " + ", ".join(f"{key}: {'ok' if good else 'FAILED'}" for key, good in report["checks"].items()))
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fieldlight", default="build/release/fieldlight", type=pathlib.Path)
    parser.add_argument("--out", default="out/cycles", type=pathlib.Path)
    parser.add_argument("--case", action="append", choices=list(CASES), help="default: all")
    parser.add_argument("--seeds", default=8, type=int, help="even, at least 4")
    parser.add_argument("--scale", default=1.0, type=float, help="multiplies the samples of each case")
    options = parser.parse_args()
    if options.seeds < 4 or options.seeds % 2:
        parser.error("--seeds must be even and at least 4")
    reports = []
    for name in options.case or CASES:
        reports.append(compare(options.fieldlight.resolve(), name, CASES[name], options.out.resolve() / name,
                               options.seeds, options.scale))
        print(describe(reports[-1]), flush=True)
    (options.out / "report.json").write_text(json.dumps(reports, indent=2) + "\n")
    return 0 if all(all(r["checks"].values()) for r in reports) else 1


if __name__ == "__main__":
    sys.exit(main())
