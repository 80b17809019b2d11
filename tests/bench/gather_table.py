#!/usr/bin/env python3
"""Measures the gather against the path tracer and prints the tables of its proofs.

    tests/bench/gather_table.py budget|truth|ablation|effects|proof|speed [--views NAME,...] [--size WxH] [--readme] ...

budget: equal time, by the renderer's clock and by the wall's. truth: cranked up, then each approximation back on;
small by default (96x72, 16 frames, 8 seeds, of the ledger 4, references of 16,384 samples, the diffuse views of
assets/; a view may ask for more in views.json), so that it can be run. ablation: each technique switched alone,
at equal probe rays (3 seeds): without it, relMSE, P99 or FLIP is worse by 5 % where MUST_GAIN says. effects: auto
against all on every scene. proof: a scene that each effect is needed in (320x240, 8 seeds). speed: medians by pass
of a draft frame. Exit code 1 where a gate fails.
Errors are relMSE without the reference's noise (and in truth without the gather's), FLIP, energy bias in %.
"""

import argparse
import json
import pathlib
import statistics
import sys
import tempfile
import time

from exr_reader import squared_bias
from gather_common import (ROOT, Runner, add_options, corrected, geometric_mean, load_views, scene_of, setting, table,
                           write_readme)
from shared_scenes import scene_files

TRUTH = {"screen_probes__spacing": 1, "screen_probes__resolution": 16, "screen_probes__importance_sampling": "off",
         "screen_probes__spatial_filter": "off", "screen_probes__jitter_interpolation": "off",
         "integrate__bent_normal": "off", "integrate__diffuse": "sum", "lighting__direct_samples": 16,
         "lighting__hit_roughness_min": 0, "film__outline_samples": 1, "integrate__reflection_neighbors": 0,
         "integrate__near_field_radius": 0}
LEDGER = {
    "SH3": {"integrate__diffuse": "sh"},
    "filter": {"screen_probes__spatial_filter": "on"},
    "culling, with its filter": {"screen_probes__spatial_filter": "on", "screen_probes__importance_sampling": "on"},
    "bent normal": {"integrate__bent_normal": "on"},
    "bent normal, shared": {"integrate__bent_normal": "on", "integrate__near_field_radius": 1},
    "bent normal, multi-bounce": {"integrate__bent_normal": "on", "integrate__near_field": "multi_bounce"},
    "jittered interpolation": {"screen_probes__jitter_interpolation": "on"},
    "intensity clamp, 100 cd/m^2": {"screen_probes__max_ray_intensity": 100},
    "outlines": {"film__outline_samples": 4},
    "spacing 16": {"screen_probes__spacing": 16},
    "resolution 8": {"screen_probes__resolution": 8},
}
LEDGER_SEEDS = 4
SEEDS = 8
ABLATION_SEEDS = 3
TRUTH_SPP = 16384
TECHNIQUES = ["screen_probes__adaptive", "screen_probes__importance_sampling", "screen_probes__lighting_pdf",
              "screen_probes__spatial_filter", "screen_probes__clamp_hit_distance", "integrate__bent_normal",
              "screen_probes__jitter_placement", "screen_probes__jitter_directions",
              "screen_probes__jitter_interpolation", "temporal__accumulate", "integrate__rough_specular",
              "screen_probes__probe_visibility", "integrate__reflections", "integrate__reflection_neighbors",
              "integrate__near_field_radius", "film__outline_samples"]
# What is not a switch.
OFF = {"film__outline_samples": 1, "integrate__reflection_neighbors": 0, "integrate__near_field_radius": 0,
       "screen_probes__jitter_interpolation": "on"}  # Which medium leaves off.
# Where the talk, or what it was built for, says that a technique earns its place.
MUST_GAIN = {"screen_probes__adaptive": ("zdm2_level", "thin_walls"),  # foreground edges
             "screen_probes__importance_sampling": ("two_rooms", "cornell_box"),  # light from a small place
             "screen_probes__lighting_pdf": ("two_rooms",),
             "screen_probes__spatial_filter": ("zdm2_level", "thin_walls"),
             "screen_probes__clamp_hit_distance": ("cornell_box", "zdm2_level"),  # contact shadows
             "integrate__bent_normal": ("cornell_box", "zdm2_level"),  # creases
             "screen_probes__jitter_placement": ("cornell_box",),
             "screen_probes__jitter_directions": ("cornell_box", "zdm2_level"),
             "temporal__accumulate": ("cornell_box", "zdm2_level"),
             "screen_probes__probe_visibility": ("two_rooms",),
             "integrate__rough_specular": ("glossy",), "integrate__reflections": ("glossy",),
             "integrate__reflection_neighbors": ("glossy",),
             "integrate__near_field_radius": ("thin_walls", "zdm2_level"),
             "film__outline_samples": ("cornell_box",)}
PROBE_PASSES = ("place_probes", "near_field", "filter_probes", "integrate", "bent_normal", "bent_normal_shadows")


# Of proof, by effect: a scene that auto drops it in, a scene that needs it, frames, and flags of camera and light.
LIVING_ROOM = ["--eye=0,1.2,0", "--look-at=0,0.5,8", "--fov=75", "--sun=10,20,60", "--sky=3,4,6"]
LIVING_ROOM_INSIDE = ["--eye=0,1.2,1", "--look-at=0,0,-1", "--fov=70", "--sky=3,4,6"]  # windows behind the camera
LIVING_ROOM_SCENE = "shared:scenes/living_room_godot/living_room.glb"
ALPHA_SCENE = "shared:scenes/alpha_blend_mode_test/AlphaBlendModeTest.glb"
LAMP_SCENE = "shared:scenes/lights_punctual_lamp/LightsPunctualLamp.gltf"
STUDIO_SCENE = "shared:scenes/studio_babylon/studio.gltf"
DARK_SCENE = "shared:scenes/suzanne/Suzanne.gltf"  # of proof: rendered with --sky=none
PROOF = {
    "punctual_lights": ("assets/cornell_box.glb", LAMP_SCENE, 16, ["--sky=0.1,0.1,0.1"]),
    "sun": ("assets/cornell_box.glb", LIVING_ROOM_SCENE, 2, LIVING_ROOM),
    "sky": ("assets/cornell_box.glb", LIVING_ROOM_SCENE, 2, LIVING_ROOM),
    "emissive_sampling": ("assets/instances.glb", "assets/cornell_box.glb", 2, []),
    "alpha_mask": ("assets/cornell_box.glb", ALPHA_SCENE, 2, ["--sun=30,45,3", "--sky=1,1,1"]),
    "alpha_blend": ("assets/cornell_box.glb", ALPHA_SCENE, 2, ["--sun=30,45,3", "--sky=1,1,1"]),
    "screen_probes": (DARK_SCENE, LIVING_ROOM_SCENE, 8, LIVING_ROOM),
    "adaptive_probes": (DARK_SCENE, "assets/two_rooms.glb", 2, []),
    "lighting_pdf": (DARK_SCENE, LIVING_ROOM_SCENE, 8, LIVING_ROOM_INSIDE),
    "spatial_filter": (DARK_SCENE, "assets/thin_walls.glb", 2, []),
    "rough_specular": ("assets/cornell_box.glb", STUDIO_SCENE, 8, ["--sun=30,45,30", "--sky=1,1.3,2"]),
    "reflections": ("assets/cornell_box.glb", "assets/glossy.glb", 8, []),
    "bent_normal": (DARK_SCENE, "assets/cornell_box.glb", 8, []),
    "temporal": ("assets/thin_walls.glb", "assets/thin_walls.glb", 8, []),
}


def passes(stats):
    return {entry["name"]: entry for entry in stats["passes"]}


def rays(stats, *names):
    """Rays a pixel a frame of these passes."""
    found = passes(stats)
    pixels = stats["width"] * stats["height"] * stats["samples_per_pixel"]
    return sum(found[name]["rays"] for name in names if name in found) / pixels


def budget(run, options):
    rows, records, failed = [], [], []
    for view in load_views(options):
        reference = run.reference(view)
        start = time.monotonic()
        picture, stats = run.gather(view)
        wall, seconds = time.monotonic() - start, stats["seconds"]["render"]
        other, other_stats = run.path(view, "--spp", 1048576, "--time-budget", seconds)
        wall_other, _ = run.path(view, "--spp", 1048576, "--time-budget", wall)
        mine, its = run.compare(picture, reference), run.compare(other, reference)
        at_wall = run.compare(wall_other, reference)
        wall_ratio = corrected(at_wall) / max(corrected(mine), 1e-9)
        error, path_error = corrected(mine), corrected(its)
        ratio, flip_ratio = path_error / max(error, 1e-9), its["flip"] / max(mine["flip"], 1e-9)
        records.append({"scene": view["name"], "diffuse": view["diffuse"], "seconds": seconds,
                        "path_seconds": other_stats["seconds"]["render"], "ratio": ratio, "flip_ratio": flip_ratio,
                        "wall_seconds": wall, "wall_ratio": wall_ratio, "path_at_wall": at_wall, "gather": mine,
                        "path": its})
        rows.append([view["name"], f"{seconds:.2f}", f"{rays(stats, 'trace_probes'):.2f}",
                     f"{rays(stats, 'direct', 'probe_shadows'):.2f}",
                     f"{rays(stats, 'bent_normal', 'bent_normal_shadows'):.2f}",
                     f"{rays(stats, 'outlines', 'probe_visibility', 'reflections', 'reflection_shadows'):.2f}",
                     f"{error:.3g}, {mine['flip']:.3f}, {mine['energy_bias']:+.2f} %",
                     f"{path_error:.3g}, {its['flip']:.3f}, {its['energy_bias']:+.2f} %", f"{ratio:.2f}",
                     f"{flip_ratio:.2f}", f"{wall:.2f}", f"{wall_ratio:.2f}"])
        if min(error, path_error) <= 0 or mine["rel_mse_corrected_details"]["low"] <= 0:
            failed.append(f"{view['name']}: the reference is too noisy to tell; raise --reference-spp")
        if view["diffuse"] and ratio < 4:
            failed.append(f"{view['name']}: relMSE is lower by {ratio:.2f}x, not 4x")
        if flip_ratio < 2:
            failed.append(f"{view['name']}: FLIP is lower by {flip_ratio:.2f}x, not 2x")
    mean = geometric_mean([record["ratio"] for record in records if record["diffuse"]])
    flip_mean = geometric_mean([record["flip_ratio"] for record in records if record["diffuse"]])
    if mean < 10:
        failed.append(f"diffuse scenes: relMSE is lower by {mean:.2f}x in the geometric mean, not 10x")
    text = table(["scene", "seconds", "probe rays", "shadow rays", "bent-normal rays",
                  "other rays a pixel a frame, besides the first one",
                  "gather: relMSE, FLIP, bias", "path: relMSE, FLIP, bias", "relMSE ratio", "FLIP ratio",
                  "process seconds", "relMSE ratio at these"], rows)
    return text + f"\n\nGeometric mean over the diffuse scenes: relMSE {mean:.2f}, FLIP {flip_mean:.2f}.", records, failed


def truth(run, options):
    """Every diffuse view of assets/ (or those of --views), on triangles and fields."""
    rows, records, failed = [], [], []
    for view in load_views(options):
        if not options.views and not (view["diffuse"] and view["scene"].startswith("assets/")):
            continue
        cases = [("triangle", "truth", {})] + ([("sdf", "truth", {})] if not options.no_sdf else [])
        cases += [("triangle", name, change) for name, change in LEDGER.items() if not options.no_ledger]
        effort = view.get("truth", {})
        spp = options.reference_spp or effort.get("reference_spp", TRUTH_SPP)
        most_seeds = options.seeds or effort.get("seeds", SEEDS)
        for tracer, name, change in cases:
            reference = run.reference(view, tracer, spp=spp)
            seeds = most_seeds if name == "truth" else min(most_seeds, LEDGER_SEEDS)
            pictures = [run.gather(view, *setting(**{**TRUTH, **change}), tracer=tracer, seed=seed)[0]
                        for seed in range(1, seeds + 1)]
            error, deviation = squared_bias(pictures, reference)
            bias = statistics.mean(run.compare(picture, reference)["energy_bias"] for picture in pictures)
            records.append({"scene": view["name"], "tracer": tracer, "case": name, "rel_mse": error,
                            "standard_error": deviation, "bias": bias, "seeds": seeds, "reference_spp": spp})
            rows.append([view["name"], tracer, name, seeds, f"{spp:,}", f"{error:.1e}", f"{deviation:.1e}",
                         f"{bias:+.3f} %"])
            if name == "truth" and view["diffuse"] and (error - 2 * deviation > 5e-4 or abs(bias) > 0.5):
                failed.append(f"{view['name']}, {tracer}: relMSE {error:.1e} +- {deviation:.1e}, bias {bias:+.3f} %")
            if name == "truth" and deviation > 5e-4:
                failed.append(f"{view['name']}, {tracer}: +- {deviation:.1e} is too noisy to tell; raise --seeds")
    text = table(["scene", "tracer", "settings", "seeds", "reference samples", "relMSE, both variances subtracted",
                  "standard error", "bias"], rows)
    return text + "\n\nFields against the path tracer on fields.", records, failed


def ablation(run, options):
    """At equal probe rays: what traces fewer a frame than the whole gets frames in proportion. Means over seeds."""
    rows, records, failed, idle = [], [], [], {}
    for view in load_views(options):
        reference = run.reference(view)
        whole, kept = None, {}
        for name in ["nothing"] + TECHNIQUES:
            flags = [] if name == "nothing" else setting(**{name: OFF.get(name, "off")})
            frames, made = options.frames, [run.gather(view, *flags, seed=1)]
            if name == "nothing":
                whole, kept = rays(made[0][1], "trace_probes"), {"picture": made[0][0]}
            elif pictures_equal(made[0][0], kept["picture"]):
                idle.setdefault(view["name"], []).append(name.replace("__", "."))
                continue
            elif rays(made[0][1], "trace_probes") > 0 and name != "temporal__accumulate":
                frames = max(1, round(options.frames * whole / rays(made[0][1], "trace_probes")))
                if frames != options.frames:
                    made = []
            made += [run.gather(view, *flags, seed=seed, frames=frames)
                     for seed in range(1 + len(made), options.seeds + 1)]
            errors = [run.compare(picture, reference) for picture, _ in made]
            found = {"relMSE": statistics.mean(corrected(error) for error in errors),
                     "P99": statistics.mean(error["percentiles"]["99"] for error in errors),
                     "FLIP": statistics.mean(error["flip"] for error in errors)}
            milliseconds = statistics.median(1000 * stats["seconds"]["render"] / stats["samples_per_pixel"]
                                             for _, stats in made)
            probe_rays = rays(made[0][1], "trace_probes")
            kept.setdefault("found", found)
            records.append({"scene": view["name"], "off": name.replace("__", "."), "ms": milliseconds,
                            "errors": errors, "frames": frames, "probe_rays_a_frame": probe_rays})
            label = name if name == "nothing" else f"{name.replace('__', '.')} = {OFF.get(name, 'off')}"
            rows.append([view["name"], label, f"{found['relMSE']:.3g}", f"{found['P99']:.3g}", f"{found['FLIP']:.4f}",
                         f"{milliseconds:.1f}", frames, f"{probe_rays * frames:.2f}"])
            if view["name"] in MUST_GAIN.get(name, ()) and not any(found[key] >= 1.05 * kept["found"][key]
                                                                   for key in ("relMSE", "P99", "FLIP")):
                failed.append(f"{view['name']}: {label} makes nothing worse by 5 %")
    text = table(["scene", "switched", "relMSE", "P99", "FLIP", "ms a frame", "frames",
                  "probe rays a pixel, all frames"], rows)
    same = "; ".join(f"{scene}: {', '.join(names)}" for scene, names in idle.items())
    return text + (f"\n\nThe same picture without: {same}." if same else ""), records, failed


def effects(run, options):
    rows, records, failed = [], [], []
    scenes = [(path.stem, path) for path in sorted((ROOT / "assets").glob("*.glb"))] + list(scene_files(options.shared))
    for name, path in scenes:
        if options.views and name not in options.views.split(","):
            continue
        stats, pictures = {}, {}
        try:
            for kind in ("auto", "all"):
                pictures[kind], stats[kind] = run.render(str(path), [
                    "--renderer", "gather", "--tracer", "triangle", "--primary", "triangle", "--accumulate",
                    options.frames, "--bounces", 1, "--seed", 1, "--effects", kind])
        except RuntimeError as error:
            failed.append(f"{name}: {error}")
            continue
        shown = [run.inspect(pictures[kind])["channels"] for kind in ("auto", "all")]
        bad = sum(channel["nan"] + channel["inf"] for channels in shown for channel in channels)
        same = pictures_equal(pictures["auto"], pictures["all"])
        off = [effect for effect, entry in stats["auto"]["effects"].items() if not entry["on"]]
        costs = [effect for effect in off if any(stats["auto"]["effects"][effect][key] for key in
                                                 ("seconds", "rays", "bytes"))]
        records.append({"scene": name, "same": same, "nonfinite": bad, "off": off})
        rows.append([name] + [f"{stats[kind]['seconds']['render']:.2f}" for kind in ("auto", "all")] +
                    [stats[kind]["rays"] for kind in ("auto", "all")] +
                    ["yes" if same else "**no**", bad, ", ".join(off)])
        failed += [f"{name}: {fault}" for fault, wrong in
                   (("auto and all differ", not same), (f"{bad} non-finite values", bad),
                    (f"off and yet costs: {costs}", costs)) if wrong]
    return table(["scene", "auto s", "all s", "auto rays", "all rays", "same", "non-finite", "off in auto"],
                 rows), records, failed


def proof(run, options):
    """For each effect, whether auto drops it in one scene, and relMSE without it over relMSE with it in another.

    The reference's own noise is in both errors, which only lowers the ratio.
    """
    rows, records, failed = [], [], []
    for effect, (off_in, scene, frames, arguments) in PROOF.items():
        if options.only and effect not in options.only.split(","):
            continue
        flags = ["--sky=none"] if off_in == DARK_SCENE else []
        flags += ["--accumulate", 1 if effect == "temporal" else frames, "--tracer", "triangle"]
        _, stats = run.render(scene_of({"scene": off_in}, options.shared), flags, size="32x24")
        dropped = not stats["effects"][effect]["on"]
        view = {"name": f"proof.{pathlib.Path(scene).stem}", "scene": scene, "camera": arguments, "light": []}
        _, stats = run.gather(view, frames=frames)
        names = [name for name, entry in stats["effects"].items() if entry["on"]]
        if effect not in names:
            failed.append(f"{effect}: auto drops it in {scene}, too")
            continue
        reference = run.reference(view)
        errors = [[run.compare(run.gather(view, "--effects", ",".join(chosen), seed=seed, frames=frames)[0],
                               reference)["rel_mse"] for seed in range(1, options.seeds + 1)]
                  for chosen in (names, [name for name in names if name != effect])]
        whole, without = (statistics.mean(values) for values in errors)
        gain = without / whole
        records.append({"effect": effect, "dropped_in": off_in, "dropped": dropped, "scene": scene, "frames": frames,
                        "arguments": arguments, "with": errors[0], "without": errors[1], "ratio": gain})
        shown = f"{pathlib.Path(off_in).stem} {' '.join(map(str, flags[:-2]))}"
        rows.append([effect, shown if dropped else "**no**",
                     f"{pathlib.Path(scene).stem} {' '.join(arguments)}".strip(), frames, f"{whole:.3g}",
                     f"{without:.3g}", f"{gain:.2f}"])
        failed += [f"{effect}: {text}" for text, wrong in ((f"auto keeps it in {off_in}", not dropped),
                   (f"{scene} is {gain:.2f}x as wrong without it, not 1.2x", not gain >= 1.2)) if wrong]
    return table(["effect", "dropped by auto in", "needed in", "frames", "relMSE with", "without", "ratio"],
                 rows), records, failed


def pictures_equal(one, other):
    from exr_reader import read_exr
    left, right = read_exr(one), read_exr(other)
    return left.keys() == right.keys() and all(left[name].tobytes() == right[name].tobytes() for name in left)


def speed(run, options):
    rows, records, failed = [], [], []
    for view in load_views(options):
        cases = {"whole": (1, options.threads), "direct": (0, options.threads), "one": (1, 1), "two": (1, 2)}
        seconds, last, by_round = {name: [] for name in cases}, {}, []
        for round_ in range(options.rounds + 1):  # the first warms up
            for name, (bounces, threads) in cases.items():
                _, stats = run.render(scene_of(view, options.shared), view["camera"] + view["light"] + [
                    "--renderer", "gather", "--quality", "draft", "--accumulate", options.frames, "--tracer",
                    "triangle", "--primary", "triangle", "--bounces", bounces], threads=threads)
                last[name] = stats
                if round_:
                    seconds[name].append(stats["seconds"]["render"])
            if round_:
                by_round.append({name: entry["seconds"] for name, entry in passes(last["whole"]).items()})
        median = {name: statistics.median(values) for name, values in seconds.items()}
        found = {name: statistics.median(entry[name] for entry in by_round) for name in by_round[0]}
        share = sum(found.get(name, 0) for name in PROBE_PASSES) / sum(found.values())
        unbent = sum(found.get(name, 0) for name in PROBE_PASSES if not name.startswith("bent")) / sum(found.values())
        ratio, scaling = median["whole"] / median["direct"], median["one"] / median["two"]
        records.append({"scene": view["name"], "median": median, "passes": found, "share": share,
                        "share_without_bent_normal": unbent})
        by_pass = ", ".join(f"{name} {1000 * value / options.frames:.1f}" for name, value in found.items())
        rows.append([view["name"], f"{1000 * median['whole'] / options.frames:.1f}", f"{ratio:.2f}",
                     f"{share:.2f}", f"{unbent:.2f}",
                     f"{scaling:.2f}", f"{last['whole']['memory']['probe_bytes'] / 2**20:.2f}", by_pass])
        failed += [f"{view['name']}: {text}" for text, wrong in
                   ((f"{ratio:.2f}x direct light, not 4x", ratio > 4), (f"probe passes take {share:.2f}", share > 0.5),
                    (f"two threads give {scaling:.2f}x", scaling < 1.8)) if wrong]
    return table(["scene", "ms a frame", "over direct light alone", "share of probe passes without tracing", "and without bent normals",
                  "one to two threads", "cache MiB", "ms by pass"], rows), records, failed


def conditions(options):
    """The command, and what it was measured at."""
    words = [word for word in sys.argv[2:] if word not in ("--readme",)]
    kept = [word for i, word in enumerate(words)
            if not any(flag in (word, words[i - 1] if i else "") for flag in ("--fieldlight", "--json", "--shared"))]
    quality = {"speed": "draft", "truth": "truth mode"}.get(options.what, "medium")
    reference = {"budget": options.reference_spp, "ablation": options.reference_spp, "proof": options.reference_spp}
    samples = f", references of {reference[options.what]:,} samples" if options.what in reference else ""
    seeds = f", {options.seeds} seeds" if options.what in ("proof", "ablation") else ""
    frames = "" if options.what == "proof" else f", {options.frames} frames"
    return (f"`tests/bench/gather_table.py {' '.join([options.what] + kept)}`: {options.size}, {quality}{frames}, "
            f"one bounce, triangles{' and fields' if options.what == 'truth' else ''}{samples}{seeds}.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = {"budget": budget, "truth": truth, "ablation": ablation, "effects": effects, "proof": proof,
                "speed": speed}
    parser.add_argument("what", choices=commands)
    add_options(parser)
    parser.add_argument("--seeds", type=int,
                        help=f"by default {SEEDS} of proof and of truth (at least 2), {ABLATION_SEEDS} of ablation")
    parser.add_argument("--no-ledger", action="store_true", help="of truth: its gate alone")
    parser.add_argument("--no-sdf", action="store_true", help="of truth: triangles alone")
    parser.add_argument("--only", help="of proof: effects with commas between")
    parser.add_argument("--rounds", type=int, default=5, help="of speed")
    options = parser.parse_args()
    options.size = options.size or {"truth": "96x72", "effects": "64x48", "proof": "320x240",
                                    "speed": "1280x720"}.get(options.what, "640x360")
    if options.what == "truth":  # Which asks the view for what is not said here.
        if options.seeds is not None and options.seeds < 2:
            parser.error("--seeds is at least 2")
    else:
        options.seeds = options.seeds or (ABLATION_SEEDS if options.what == "ablation" else SEEDS)
        options.reference_spp = options.reference_spp or 4096
    with tempfile.TemporaryDirectory() as folder:
        text, records, failed = commands[options.what](Runner(options, folder), options)
    text += "\n\n" + conditions(options)
    if failed:
        text += " Gates that fail: " + "; ".join(failed) + "."
    print(text)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(records, indent=1))
    if options.readme:
        write_readme(options.what, text)
    for line in failed:
        print(f"fails: {line}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
