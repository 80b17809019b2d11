#!/usr/bin/env python3
"""Accuracy against time: our tracers, Embree and OpenVDB on the same rays, as the README's tables.

    tests/bench/trace_table.py [--program build/release/tests/fieldlight_bench] [--rounds 5] [--side 512]
                               [--filter REGEX] [--save RESULT.json]
    tests/bench/trace_table.py --from RESULT.json     prints the tables of an earlier run
    tests/bench/trace_table.py --short                few rays, no clock: does every row run, is every error in bounds?

Rows run in rounds, each in random order, in one process; every figure is the median of the rounds. Wants an idle machine.
Exit code 1 if a row fails or, with --short, an error is out of bounds; speed is printed and never gated.
"""

import argparse
import collections
import json
import pathlib
import statistics
import subprocess
import sys

MODES = ("sdf_eps", "sdf_secant", "sdf_cubic")
COARSE = tuple(f"{mode}_8bit" for mode in MODES)
PACKETS = tuple(f"{name}{fast}" for name in ("embree8", "embree16", "embree_stream") for fast in ("", "_fast"))
EMBREE = ("embree1", "embree1_fast") + PACKETS
RAYS = ("primary", "bounce", "occlusion")
MESHES = (("hall", 128), ("hall", 256), ("blob", 128), ("blob", 256))
CROWDS = (1, 10, 100, 1000)

# The rows that the floors on speed are about.
FLOOR_ROWS = ("/((hall|blob)/bounce/128(/threads:[12])?|hall/(primary|bounce)/256|hall/(primary|occlusion)/128|blob/primary/256"
              "|crowd.*/bounce/64)$")

# Largest values that --short lets pass: the hit mode's margin where it has one, else about twice what was measured.
BOUNDS = {
    "sdf_cubic": {"error_p99_voxels": 1e-3, "reference_disagreement": 1e-3, "mesh_error_mean_voxels": 0.1},
    "sdf_secant": {"error_p99_voxels": 0.05, "reference_disagreement": 0.01, "mesh_error_mean_voxels": 0.1},
    "sdf_eps": {"error_p99_voxels": 0.5, "reference_disagreement": 0.01, "mesh_error_mean_voxels": 0.1},
    "sdf_scalar": {"error_p99_voxels": 0.0, "reference_disagreement": 0.0, "mesh_error_mean_voxels": 0.1},
    "openvdb": {"error_p99_voxels": 0.05, "reference_disagreement": 0.01, "mesh_error_mean_voxels": 0.1},
    "embree": {"hit_disagreement": 1e-3, "mesh_error_mean_voxels": 1e-3},
}


def run_program(options):
    """The program's report, as Google Benchmark writes it."""
    command = [options.program, "--benchmark_format=json", f"--side={options.side}", f"--fields={options.fields}",
               f"--benchmark_min_time={options.seconds}", f"--benchmark_repetitions={options.rounds}"]
    if options.rounds > 1:
        command.append("--benchmark_enable_random_interleaving=true")
    if options.filter:
        command.append(f"--benchmark_filter={options.filter}")
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"{options.program} failed with {done.returncode}")
    return json.loads(done.stdout)


class Results:
    """Medians by row: (tracer, mesh, rays, resolution, threads) -> {counter: value}."""

    def __init__(self, report):
        rounds = collections.defaultdict(list)
        self.failures = []
        for run in report["benchmarks"]:
            if run["run_type"] != "iteration":
                continue
            if run.get("error_occurred"):
                self.failures.append(f"{run['run_name']}: {run['error_message']}")
            else:
                rounds[run["run_name"]].append(run)
        self.context = report["context"]
        self.rounds = max((len(runs) for runs in rounds.values()), default=0)
        self.rows = {}
        spreads = []
        for name, runs in rounds.items():
            _, tracer, mesh, rays, resolution, *threads = name.split("/")
            key = tracer, mesh, rays, int(resolution), int(threads[0].split(":")[1]) if threads else 0
            counters = [c for c in runs[0] if c.endswith(("_second", "_ray", "_voxels", "_disagreement"))
                        and c != "items_per_second"]
            self.rows[key] = {c: statistics.median(run[c] for run in runs) for c in counters}
            if len(runs) > 3:
                low, middle, high = statistics.quantiles((run["rays_per_second"] for run in runs), n=4)
                spreads.append((high - low) / middle)
        self.spread = statistics.median(spreads) if spreads else None

    def get(self, counter, tracer, mesh, rays, resolution, threads=0):
        return self.rows.get((tracer, mesh, rays, resolution, threads), {}).get(counter)

    def rate(self, *row):
        """Millions of rays a second, or None."""
        value = self.get("rays_per_second", *row)
        return value and 1e-6 * value

    def best(self, tracers, *row):
        rates = [rate for tracer in tracers if (rate := self.rate(tracer, *row))]
        return max(rates, default=None)


def number(value, form="{:.2f}"):
    return "" if value is None else form.format(value)


def millions(value):
    return number(value, "{:.1f}" if value and value >= 10 else "{:.2f}")


def print_table(header, rows):
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        if any(row[1:]):
            print("| " + " | ".join(row) + " |")
    print()


def print_rates(results):
    print("Millions of rays a second on one thread: primary, bounce, occlusion. Embree: robust; in brackets, not robust.\n")
    rows = []
    for tracer in MODES + COARSE + ("sdf_scalar", "openvdb", "embree1", "embree8", "embree16", "embree_stream"):
        cells = []
        for mesh, resolution in MESHES:
            parts = []
            for rays in RAYS:
                rate, fast = (results.rate(name, mesh, rays, resolution) for name in (tracer, tracer + "_fast"))
                if rate:
                    parts.append(millions(rate) + (f" ({millions(fast)})" if fast else ""))
            cells.append(", ".join(parts))
        rows.append([f"`{tracer}`"] + cells)
    print_table(["tracer"] + [f"{mesh} {resolution}" for mesh, resolution in MESHES], rows)


def print_errors(results):
    print("Errors in voxels on bounce rays: mean and 99th percentile against the double-precision walk of the same field; "
          "mean distance from the triangles; rays of a hundred that hit where the mesh is missed or the reverse; steps a ray.\n")
    rows = []
    for tracer in MODES + COARSE + ("sdf_scalar", "openvdb"):
        cells = []
        for mesh, resolution in MESHES:
            row = tracer, mesh, "bounce", resolution
            if not results.rate(*row):
                cells.append("")
                continue
            disagree = 100.0 * results.get("hit_disagreement", *row)
            parts = [number(results.get(counter, *row), "{:.1g}" if counter != "mesh_error_mean_voxels" else "{:.3f}")
                     for counter in ("error_mean_voxels", "error_p99_voxels", "mesh_error_mean_voxels")]
            parts += [f"{disagree:.2f} %", number(results.get("steps_per_ray", *row), "{:.1f}")]
            cells.append(", ".join(part for part in parts if part))
        rows.append([f"`{tracer}`"] + cells)
    print_table(["tracer"] + [f"{mesh} {resolution}" for mesh, resolution in MESHES], rows)


def print_instruction_sets(results):
    best = results.context.get("instruction_set", "best").lower()
    sets = [best] + sorted({key[0].split("_")[2] for key in results.rows if key[0].startswith(MODES) and key[0].count("_") == 2
                           and key[0] not in COARSE})
    print(f"Millions of bounce rays a second by instruction set: {', '.join(sets)}.\n")
    rows = []
    for mode in MODES:
        cells = [", ".join(millions(results.rate(mode if name == best else f"{mode}_{name}", mesh, "bounce", resolution))
                           for name in sets) for mesh, resolution in MESHES]
        rows.append([f"`{mode}`"] + [cell.strip(", ") for cell in cells])
    print_table(["tracer"] + [f"{mesh} {resolution}" for mesh, resolution in MESHES], rows)


def print_crowds(results):
    print("Overlapping instances of a mesh of 20,480 triangles, fields at 64: millions of bounce rays a second.\n")
    rows = [[f"`{tracer}`"] + [millions(results.rate(tracer, f"crowd{n}", "bounce", 64)) for n in CROWDS]
            for tracer in MODES + EMBREE]
    rows.append(["best of ours / best of Embree"] +
                [number(ratio(results.best(MODES, f"crowd{n}", "bounce", 64), results.best(EMBREE, f"crowd{n}", "bounce", 64)))
                 for n in CROWDS])
    print_table(["tracer"] + [f"{n:,}" for n in CROWDS], rows)


def ratio(a, b):
    return a / b if a and b else None


def floors(results):
    """(text, wanted, [(what, reached)]) of every floor on speed."""
    def against(tracers, mesh, rays, resolution):
        other = results.best(tracers, mesh, rays, resolution)
        return [(mode[4:], ratio(results.rate(mode, mesh, rays, resolution), other)) for mode in MODES]

    for mesh, resolution, embree, openvdb in (("blob", 128, 3.0, 25.0), ("hall", 128, 2.5, 25.0), ("hall", 256, 1.6, 15.0)):
        row = mesh, "bounce", resolution
        yield f"bounce, {mesh} {resolution}, against Embree's best closest hit", embree, against(EMBREE, *row)
        yield f"bounce, {mesh} {resolution}, against OpenVDB", openvdb, against(("openvdb",), *row)
    for mesh, resolution, wanted in (("hall", 128, 0.7), ("hall", 256, 0.55), ("blob", 256, 1.3)):
        yield f"primary, {mesh} {resolution}, against Embree's best packet", wanted, against(PACKETS, mesh, "primary", resolution)
    yield "occlusion, hall 128, against Embree's best any hit", 1.5, against(EMBREE, "hall", "occlusion", 128)
    yield "bounce, crowd of 1,000 at 64, against Embree's best closest hit", 1.5, against(EMBREE, "crowd1000", "bounce", 64)
    places = [(mesh, "bounce", 128) for mesh in ("hall", "blob")]
    yield "cubic against eps, bounce, 128", 0.5, [
        (row[0], ratio(results.rate("sdf_cubic", *row), results.rate("sdf_eps", *row))) for row in places]
    if results.context.get("instruction_set", "").startswith("AVX3"):
        yield "AVX2 against AVX-512, bounce, 128", 0.5, [
            (f"{mode[4:]} {row[0]}", ratio(results.rate(f"{mode}_avx2", *row), results.rate(mode, *row)))
            for mode in MODES for row in places]
    avx2 = "" if results.context.get("instruction_set") == "AVX2" else "_avx2"
    yield "SSE4 against AVX2, bounce, 128", 0.5, [
        (f"{mode[4:]} {row[0]}", ratio(results.rate(f"{mode}_sse4", *row), results.rate(mode + avx2, *row)))
        for mode in MODES for row in places]
    yield "two threads against one, bounce, 128", 1.9, [
        (f"{mode[4:]} {row[0]}", ratio(results.rate(mode, *row, 2), results.rate(mode, *row, 1)))
        for mode in ("sdf_eps", "sdf_cubic") for row in places]


def print_floors(results):
    print("Floors on speed. Where a hit mode is not named, each is held against the floor by itself.\n")
    rows = []
    for text, wanted, reached in floors(results):
        known = [(what, value) for what, value in reached if value is not None]
        if not known:
            continue
        short = [what for what, value in known if value < wanted]
        verdict = "met" if not short else "not met" if len(short) == len(known) else "not met by " + ", ".join(short)
        rows.append([text, f"{wanted:g}x", ", ".join(f"{what} {value:.2f}x" for what, value in known), verdict])
    print_table(["floor", "wanted", "reached", ""], rows)


def check_errors(results, expected):
    failures = []
    names = {f"trace/{t}/{m}/{r}/{n}" + (f"/threads:{k}" if k else "") for t, m, r, n, k in results.rows}
    failures += [f"{name}: no result" for name in sorted(expected - names)]
    for (tracer, mesh, rays, resolution, _), row in results.rows.items():
        bounds = next(bounds for name, bounds in BOUNDS.items() if tracer.startswith(name))
        for counter, most in bounds.items():
            if not row.get(counter, 0.0) <= most:
                failures.append(f"{tracer}/{mesh}/{rays}/{resolution}: {counter} is {row[counter]:.3g}, over {most:g}")
        if not row["rays_per_second"] > 0.0:
            failures.append(f"{tracer}/{mesh}/{rays}/{resolution}: no speed")
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/release/tests/fieldlight_bench")
    parser.add_argument("--fieldlight", help="the program beside which --program is found")
    parser.add_argument("--fields", help="where baked fields are kept; default: beside the program's folder")
    parser.add_argument("--side", type=int, default=512, help="side^2 rays a set")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=0.2, help="least time a row and round")
    parser.add_argument("--filter", help="regular expression on the rows' names")
    parser.add_argument("--floors", action="store_true", help="only the rows that the floors on speed are about")
    parser.add_argument("--save", help="keep the report of the program here")
    parser.add_argument("--from", dest="source", help="a report kept earlier")
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args()
    if options.fieldlight:
        options.program = str(pathlib.Path(options.fieldlight).parent / "tests" / "fieldlight_bench")
    if not options.fields:
        options.fields = str(pathlib.Path(options.program).parent.parent / "bench_fields")
    if options.floors:
        options.filter = FLOOR_ROWS
    if options.short:
        options.side, options.rounds, options.seconds = 64, 1, 1e-6

    if options.source:
        report = json.loads(pathlib.Path(options.source).read_text())
    else:
        report = run_program(options)
    if options.save:
        pathlib.Path(options.save).write_text(json.dumps(report, indent=1))
    results = Results(report)
    failures = list(results.failures)
    if options.short:
        listed = subprocess.run([options.program, "--benchmark_list_tests", f"--benchmark_filter={options.filter or 'all'}"],
                                capture_output=True, text=True, check=True)
        failures += check_errors(results, set(listed.stdout.split()))
        print(f"{len(results.rows)} rows")
    else:
        print_rates(results)
        print_errors(results)
        print_instruction_sets(results)
        print_crowds(results)
        print_floors(results)
        spread = f"; median spread between quartiles {100.0 * results.spread:.1f} %" if results.spread else ""
        print(f"Medians of {results.rounds} rounds{spread}.")
    for failure in failures:
        print("FAILED", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
