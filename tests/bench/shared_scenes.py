"""Where the real scenes are and which file of each folder is the scene."""

import os
import pathlib

SKIPPED = ("invalid", "unsupported", "skies", "exr", "volumes", "LICENSES")


def add_shared_option(parser):
    parser.add_argument("--shared", default=os.environ.get("FIELDLIGHT_SHARED", "../shared"),
                        help="folder that holds scenes/; default $FIELDLIGHT_SHARED or ../shared")


def scene_files(shared):
    """Pairs of a scene's name and its file: all that load, those of unsupported/ last, whose extensions are decoded."""
    scenes = pathlib.Path(shared) / "scenes"
    if not scenes.is_dir():
        raise SystemExit(f"{scenes} is missing; set FIELDLIGHT_SHARED or --shared")
    folders = [folder for folder in sorted(scenes.iterdir()) if folder.name not in SKIPPED]
    folders += sorted((scenes / "unsupported").iterdir())
    for folder in folders:
        if folder.is_dir():
            files = sorted(list(folder.glob("*.gltf")) + list(folder.glob("*.glb")))
            if files:
                yield folder.name, files[0]
