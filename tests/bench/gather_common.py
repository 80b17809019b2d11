"""What the scripts of the gather's proofs share: views, rendering, cached references, errors, README markers."""

import hashlib
import json
import math
import pathlib
import re
import subprocess
import tempfile

from shared_scenes import add_shared_option

# Where references are kept between runs, unless --cache says otherwise.
REFERENCES = str(pathlib.Path(tempfile.gettempdir()) / "fieldlight_references")

ROOT = pathlib.Path(__file__).resolve().parents[2]


def add_options(parser):
    parser.add_argument("--fieldlight", default=str(ROOT / "build/release/fieldlight"))
    add_shared_option(parser)
    parser.add_argument("--size", help="WxH; by default what the command says")
    parser.add_argument("--threads", default="0")
    parser.add_argument("--cache", default=REFERENCES, help="folder that keeps the references")
    parser.add_argument("--views", help="names of tests/images/views.json with commas between; all by default")
    parser.add_argument("--reference-spp", type=int, help="16384 of truth, else 4096")
    parser.add_argument("--frames", type=int, default=16, help="--accumulate of the gather")
    parser.add_argument("--json", help="write the rows to this file")
    parser.add_argument("--readme", action="store_true", help="rewrite the tables between README.md's markers")


def load_views(options):
    views = json.loads((ROOT / "tests/images/views.json").read_text())["views"]
    if options.views:
        wanted = options.views.split(",")
        unknown = set(wanted) - {view["name"] for view in views}
        if unknown:
            raise SystemExit(f"no such view: {', '.join(sorted(unknown))}")
        views = [view for view in views if view["name"] in wanted]
    return views


def scene_of(view, shared):
    name = view["scene"]
    path = pathlib.Path(shared, name[len("shared:"):]) if name.startswith("shared:") else ROOT / name
    return str(path.resolve())


class Runner:
    """Renders into `folder`; references into the cache."""

    def __init__(self, options, folder):
        self.options, self.folder, self.count = options, pathlib.Path(folder), 0
        self.cache = pathlib.Path(options.cache)
        self.cache.mkdir(parents=True, exist_ok=True)

    def flags(self, scene, arguments, size, threads):
        return [scene, "--size", size or self.options.size, "--threads", str(threads or self.options.threads),
                "--quiet"] + [str(word) for word in arguments]

    def render(self, scene, arguments, output=None, size=None, threads=None):
        """Picture and --stats of one render."""
        self.count += 1
        output = output or self.folder / f"{self.count}.exr"
        stats = output.with_suffix(".json")
        command = [self.options.fieldlight, "render"] + self.flags(scene, arguments, size, threads) + \
            ["-o", str(output), "--stats", str(stats)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
        return output, json.loads(stats.read_text())

    def gather(self, view, *arguments, tracer="triangle", seed=1, frames=None, bounces=1, quality="medium"):
        return self.render(scene_of(view, self.options.shared), view["camera"] + view["light"] + [
            "--renderer", "gather", "--quality", quality, "--accumulate", frames or self.options.frames, "--bounces",
            bounces, "--tracer", tracer, "--primary", tracer, "--seed", seed] + list(arguments))

    def path(self, view, *arguments, tracer="triangle", seed=1, bounces=1):
        return self.render(scene_of(view, self.options.shared), view["camera"] + view["light"] + [
            "--renderer", "path", "--bounces", bounces, "--tracer", tracer, "--primary", tracer, "--seed", seed] +
            list(arguments))

    def reference(self, view, tracer="triangle", size=None, spp=None):
        """From the cache: its key holds scene content and flags, neither the program's path nor its version."""
        scene = scene_of(view, self.options.shared)
        arguments = view["camera"] + view["light"] + [
            "--renderer", "path", "--bounces", 1, "--spp", spp or self.options.reference_spp, "--tracer", tracer,
            "--primary", tracer, "--seed", 987654, "--aov", "Variance"]
        key = [size or self.options.size] + [str(word) for word in arguments]
        digest = hashlib.sha256(pathlib.Path(scene).read_bytes() + "\0".join(key).encode()).hexdigest()[:24]
        picture = self.cache / f"{view['name']}.{tracer}.{digest}.exr"
        if not picture.exists():
            part, _ = self.render(scene, arguments, self.cache / f"part.{picture.name}", size)
            part.with_suffix(".json").unlink()
            part.rename(picture)
        return picture

    def compare(self, picture, reference):
        done = subprocess.run([self.options.fieldlight, "compare", str(picture), str(reference), "--json"],
                              capture_output=True, text=True)
        if not done.stdout.strip():
            raise RuntimeError(f"compare {picture} {reference}: {done.stderr.strip()}")
        return json.loads(done.stdout)

    def inspect(self, picture):
        done = subprocess.run([self.options.fieldlight, "inspect", str(picture), "--json"], capture_output=True,
                              text=True, check=True)
        return json.loads(done.stdout)


def setting(**values):
    """`--set` flags; of a name, __ stands for the point."""
    return [word for name, value in values.items() for word in ("--set", f"{name.replace('__', '.')}={value}")]


def corrected(errors):
    """relMSE without the reference's own noise."""
    return errors.get("rel_mse_corrected", errors["rel_mse"])


def geometric_mean(values):
    return math.exp(sum(math.log(max(value, 1e-12)) for value in values) / len(values)) if values else float("nan")


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def write_readme(name, text):
    readme = ROOT / "README.md"
    old = readme.read_text()
    begin, end = f"<!-- gather:{name} -->", f"<!-- /gather:{name} -->"
    if begin not in old or end not in old:
        raise SystemExit(f"README.md has no markers {begin} and {end}")
    new = re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: f"{begin}\n{text}\n{end}", old, flags=re.DOTALL)
    readme.write_text(new)
