#!/usr/bin/env python3
"""Opens a report's page in headless Chromium and checks what it shows against the EXR files beside it.

    tests/page/report_page_test.py --sample build/release/tests/fieldlight_sample_report   the report with known content
    tests/page/report_page_test.py --report out/room                                       one that compare has written
"""

import argparse
import math
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import unittest

from browser import Browser
from exr_file import read_exr
from png_file import read_png

WINDOW = 1280, 1000
browser = None
folder = None
is_sample = False


def open_page(fragment="", **options):
    browser.set_window(*WINDOW)
    browser.open_page((folder / "report.html").as_uri() + fragment, **options)


def viewer(expression):
    return browser.evaluate(f"window.fieldlight.viewer.{expression}")


def settle():
    """Waits until what a key or the mouse caused is drawn."""
    browser.evaluate("window.fieldlight.viewer.settled()")


def press(*keys):
    for key in keys:
        browser.press(key)
        settle()


def canvas_box():
    return browser.evaluate("(() => { const box = document.getElementById('canvas').getBoundingClientRect();"
                            " return {x: box.x, y: box.y, width: box.width, height: box.height}; })()")


def focus_canvas():
    browser.evaluate("document.getElementById('canvas').scrollIntoView({block: 'center'})")
    box = canvas_box()
    browser.click(box["x"] + 5, box["y"] + 5)


def pixel_place(x, y):
    """Where the middle of a picture's pixel lies in the window."""
    box, view = canvas_box(), viewer("view")
    return box["x"] + view["x"] + (x + 0.5) * view["zoom"], box["y"] + view["y"] + (y + 0.5) * view["zoom"]


# A copy, since a browser warns of pages that read their own canvas often.
CANVAS_COPY = ("(() => { const {view, canvas} = window.fieldlight.viewer;"
               " const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', {willReadFrequently: true});"
               " copy.drawImage(canvas, 0, 0);")


def canvas_color(x, y):
    """What the canvas shows in the middle of a picture's pixel."""
    return browser.evaluate(
        CANVAS_COPY +
        f" return Array.from(copy.getImageData(Math.floor(devicePixelRatio * (view.x + {x + 0.5} * view.zoom)),"
        f" Math.floor(devicePixelRatio * (view.y + {y + 0.5} * view.zoom)), 1, 1).data); }})()")


def aces_level(radiance, ev):
    """Unrounded 8-bit sRGB level by the published formulas, in double precision."""
    x = max(0.0, radiance / (1.2 * 2.0 ** ev))
    x = min(x, 1e6)
    y = min(1.0, x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14))
    return 255.0 * (12.92 * y if y <= 0.0031308 else 1.055 * y ** (1.0 / 2.4) - 0.055)


def bits(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


class ReportPage(unittest.TestCase):
    def tearDown(self):
        self.assertEqual(browser.complaints(), [], "the console must stay silent")
        self.assertEqual([url for url in browser.requests() if not url.startswith((folder / "report.html").as_uri())],
                         [], "the page must ask for nothing")

    def pictures(self):
        """Name and file of each picture whose values are in the page."""
        found = browser.evaluate("window.fieldlight.viewer.data.pictures.filter((picture) => picture.exact)")
        self.assertGreater(len(found), 1)
        return [(picture["name"], folder / picture["file"]) for picture in found]

    def test_holds_the_values_of_the_exr_files_bit_by_bit(self):
        open_page()
        for name, path in self.pictures():
            width, height, channels = read_exr(path)
            page = browser.evaluate(
                "(async () => { const {data} = window.fieldlight.viewer;"
                f" const {{radiance}} = await data.load(data.indexOf({name!r}));"
                " return radiance.map((plane) => Array.from(new Uint32Array(plane.buffer))); })()")
            for plane, channel in zip(page, "RGB"):
                expected = [bits(value) for value in channels[channel]]
                self.assertEqual(len(plane), width * height)
                differing = [i for i, (a, b) in enumerate(zip(plane, expected)) if a != b]
                self.assertEqual(differing, [], f"{name} {channel}")

    def test_answers_for_single_pixels(self):
        open_page()
        name, path = self.pictures()[-1]
        width, height, channels = read_exr(path)
        x, y = width - 3, height - 2
        values = browser.evaluate(f"window.fieldlight.pixel({name!r}, {x}, {y})")
        self.assertEqual(values, [channels[c][y * width + x] for c in "RGB"])

    def test_shows_what_the_tone_curve_says(self):
        open_page("#mode=a")
        name, path = self.pictures()[1]
        browser.evaluate(f"window.fieldlight.viewer.set({{a: window.fieldlight.viewer.data.indexOf({name!r})}})")
        focus_canvas()
        width, height, channels = read_exr(path)
        choose = random.Random(1)
        for keys in ([], ["+"] * 3, ["-"] * 9):
            press(*keys)
            ev = viewer("ev")
            for _ in range(40):
                x, y = choose.randrange(width), choose.randrange(height)
                shown = canvas_color(x, y)
                self.assertEqual(shown[3], 255)
                for level, channel in zip(shown, "RGB"):
                    exact = aces_level(channels[channel][y * width + x], ev)
                    # The program rounds in float32, so that a level within 1e-3 of the border may fall either way.
                    self.assertLessEqual(abs(level - exact), 0.501, f"{name} ({x}, {y}) {channel} at EV {ev}")

    def test_paints_heat_maps(self):
        if not is_sample:
            self.skipTest("knows the values of the sample only")
        open_page("#a=fields%20128&mode=flip")
        self.assertEqual(canvas_color(0, 0)[:3], [0, 0, 4], "FLIP of 0 is the dark end of magma")
        self.assertEqual(canvas_color(47, 35)[:3], [252, 253, 191], "FLIP of 1 the bright one")
        browser.evaluate("window.fieldlight.viewer.set({mode: 'steps'})")
        self.assertEqual(canvas_color(0, 0)[:3], [68, 1, 84])
        browser.evaluate("window.fieldlight.viewer.set({mode: 'error'})")
        # 25 % less at the right edge, 20.8 % at x = 40, far above 0.01: at 0.773 of the three decades to 100 %.
        for level, expected in zip(canvas_color(40, 30), (252, 146, 104)):
            self.assertAlmostEqual(level, expected, delta=2)

    def test_paints_broken_pixels_magenta(self):
        if not is_sample:
            self.skipTest("only the sample has broken pixels")
        open_page()
        press_count = len(self.pictures())
        browser.evaluate(f"window.fieldlight.viewer.set({{a: {press_count - 1}, mode: 'a'}})")
        for mode in ("a", "signed", "difference", "flip", "error"):
            browser.evaluate(f"window.fieldlight.viewer.set({{mode: '{mode}'}})")
            self.assertEqual(canvas_color(2, 0), [255, 0, 255, 255], mode)

    def test_obeys_the_keys(self):
        open_page()
        focus_canvas()
        for key, mode in (("b", "b"), ("a", "a"), ("s", "slider"), ("d", "difference"), ("g", "signed"), ("f", "flip"),
                          ("e", "error"), (" ", "a"), (" ", "b"), (" ", "a"), ("B", "b")):
            press(key)
            self.assertEqual(viewer("state.mode"), mode, f"after '{key}'")
        count = len(self.pictures())
        first = viewer("state.a")
        press("]")
        self.assertEqual(viewer("state.a"), (first + 1) % count)
        press("[")
        self.assertEqual(viewer("state.a"), first)
        second = viewer("state.b")
        press("{")
        self.assertEqual(viewer("state.b"), (second - 1) % count)
        ev = viewer("ev")
        press("+", "+")
        self.assertAlmostEqual(viewer("ev"), ev - 1.0)
        press("-")
        self.assertAlmostEqual(viewer("ev"), ev - 0.5)
        press("r")
        self.assertAlmostEqual(viewer("ev"), ev)
        zoom = viewer("view.zoom")
        press("z", "z")
        self.assertAlmostEqual(viewer("view.zoom"), 2.0 * zoom)
        x = viewer("view.x")
        press("ArrowRight")
        self.assertAlmostEqual(viewer("view.x"), x - 48)
        press("1")
        self.assertAlmostEqual(viewer("view.zoom"), 1.0)
        press("0")
        self.assertAlmostEqual(viewer("view.zoom"), zoom)
        hidden = "document.getElementById('help').hidden"
        press("?")
        self.assertFalse(browser.evaluate(hidden))
        press("Escape")
        self.assertTrue(browser.evaluate(hidden))

    def test_leaves_keys_to_the_page_until_it_has_the_focus(self):
        open_page()
        browser.press("b")
        self.assertEqual(viewer("state.mode"), "a")

    def test_keeps_its_state_in_the_address(self):
        open_page()
        focus_canvas()
        self.assertEqual(browser.evaluate("location.hash"), "", "opening a page does not change its address")
        press("]", "d", "+")
        fragment = browser.evaluate("location.hash")
        state, ev = viewer("state"), viewer("ev")
        open_page(fragment)
        self.assertEqual(viewer("state"), state)
        self.assertEqual(viewer("ev"), ev)
        browser.evaluate("location.hash = 'a=nobody&mode=nothing&stops=x'")
        self.assertEqual(viewer("state.mode"), "difference", "what is unknown is ignored")

    def test_follows_a_thumbnails_link(self):
        open_page()
        name = self.pictures()[-1][0]
        browser.evaluate(f"[...document.querySelectorAll('.picture')].find((picture) =>"
                         f" picture.querySelector('h3').textContent === {name!r}).querySelector('a').click()")
        browser.evaluate("new Promise((done) => setTimeout(done, 50))")
        settle()
        self.assertEqual(viewer("data.pictures[window.fieldlight.viewer.state.a].name"), name)

    def test_zooms_about_the_pointer_and_reads_out_what_is_under_it(self):
        open_page("#mode=a")
        name, path = self.pictures()[0]
        browser.evaluate(f"window.fieldlight.viewer.set({{a: window.fieldlight.viewer.data.indexOf({name!r})}})")
        width, height, channels = read_exr(path)
        x, y = width // 2 + 3, height // 2 - 4
        before = viewer("view.zoom")
        browser.evaluate("document.getElementById('canvas').scrollIntoView({block: 'center'})")
        begin = self.scrolled()
        browser.mouse("mouseWheel", *pixel_place(x, y), deltaX=0, deltaY=-240)
        self.assertNotEqual(self.scrolled(), begin, "the wheel moves the page until the picture is clicked")
        self.assertEqual(viewer("view.zoom"), before)
        focus_canvas()
        place = pixel_place(x, y)
        browser.mouse("mouseMoved", *place)
        browser.mouse("mouseWheel", *place, deltaX=0, deltaY=-240)
        self.assertAlmostEqual(viewer("view.zoom"), 2.0 * before)
        after = pixel_place(x, y)
        self.assertAlmostEqual(place[0], after[0], delta=0.51)
        self.assertAlmostEqual(place[1], after[1], delta=0.51)
        texts = browser.evaluate("[...document.querySelectorAll('#readout tbody tr')[0].cells].map((c) => c.textContent)")
        self.assertEqual(browser.evaluate("document.getElementById('readout-place').textContent"), f"pixel {x}, {y}")
        for text, channel in zip(texts[1:4], "RGB"):
            value = channels[channel][y * width + x]
            self.assertEqual(bits(float(text)), bits(value), "the shortest text that reads back as the same float32")
            self.assertLessEqual(len(text), 16)

    @staticmethod
    def scrolled():
        """How far the page is scrolled, once it stands still."""
        return browser.evaluate(
            "(async () => { let last = -1; while (last !== scrollY) {"
            " last = scrollY; await new Promise((done) => setTimeout(done, 150)); } return last; })()")

    def test_prints_numbers_into_large_pixels(self):
        open_page("#mode=a")
        focus_canvas()
        counts = {}
        for mode in ("a", "slider", "difference", "error"):
            browser.evaluate(f"window.fieldlight.viewer.set({{mode: '{mode}'}})")
            browser.evaluate("window.fieldlight.viewer.place(100, -300, -300)")
            counts[mode] = browser.evaluate(
                CANVAS_COPY + " const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);"
                " return new Set(new Uint32Array(data.buffer)).size; })()")
        for mode, count in counts.items():
            self.assertGreater(count, 60, f"{mode}: glyphs have smooth edges, flat pixels have not")

    def test_moves_by_dragging_and_splits_by_the_slider(self):
        open_page("#mode=slider")
        focus_canvas()
        box = canvas_box()
        middle = box["y"] + box["height"] / 2
        browser.mouse("mousePressed", box["x"] + box["width"] / 2, middle, button="left", buttons=1, clickCount=1)
        browser.mouse("mouseMoved", box["x"] + box["width"] / 4, middle, button="left", buttons=1)
        browser.mouse("mouseReleased", box["x"] + box["width"] / 4, middle, button="left", clickCount=1)
        self.assertAlmostEqual(viewer("state.split"), 0.25, places=3)
        x = viewer("view.x")
        browser.mouse("mousePressed", box["x"] + box["width"] * 0.6, middle, button="left", buttons=1, clickCount=1)
        browser.mouse("mouseMoved", box["x"] + box["width"] * 0.6 + 40, middle, button="left", buttons=1)
        browser.mouse("mouseReleased", box["x"] + box["width"] * 0.6 + 40, middle, button="left", clickCount=1)
        self.assertAlmostEqual(viewer("view.x"), x + 40, delta=0.01)

    def test_fits_narrow_and_wide_windows(self):
        for width in (360, 768, 1920):
            browser.set_window(width, 900)
            browser.open_page((folder / "report.html").as_uri())
            self.assertLessEqual(browser.evaluate("document.documentElement.scrollWidth"), width,
                                 "the page itself must not scroll sideways")
            self.assertLessEqual(canvas_box()["width"], width)

    def test_is_whole_without_scripts(self):
        open_page(scripts=False)
        document = browser.send("DOM.getDocument", depth=0)["root"]["nodeId"]

        def nodes(selector):
            return browser.send("DOM.querySelectorAll", nodeId=document, selector=selector)["nodeIds"]

        def box(node):
            quad = browser.send("DOM.getBoxModel", nodeId=node)["model"]["content"]
            return quad[0], quad[1], quad[2] - quad[0], quad[5] - quad[1]

        images = nodes(".maps img")
        self.assertGreater(len(images), 4)
        browser.set_window(WINDOW[0], math.ceil(browser.page_height()))
        for node in images:
            x, y, width, height = box(node)
            self.assertGreater(width * height, 5000)
            picture = read_png(browser.screenshot(clip=(x, y, width, height)))
            colors = {bytes(row[i:i + 3]) for row in picture[2] for i in range(0, len(row), picture[3])}
            self.assertGreater(len(colors), 20 if not is_sample else 3, "a thumbnail that shows nothing")
        self.assertEqual(len(nodes("#viewer[hidden]")), 1, "the viewer does not show what it cannot do")
        self.assertGreater(len(nodes("#summary tbody tr")), 1)
        plots = nodes("svg.plot")
        self.assertEqual(len(plots), 4)
        shown = [node for node in plots if self.has_box(node)]
        self.assertEqual(shown, plots[:1], "one figure, that of wall time")
        (label,) = nodes("label[for=axis-rays]")
        x, y, width, height = box(label)
        browser.click(x + width / 2, y + height / 2)
        self.assertEqual([node for node in plots if self.has_box(node)], plots[3:], "the axis is chosen without scripts")

    @staticmethod
    def has_box(node):
        try:
            browser.send("DOM.getBoxModel", nodeId=node)
            return True
        except Exception:
            return False


def main():
    global browser, folder, is_sample
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--sample", type=pathlib.Path, help="the program that writes the report with known content")
    which.add_argument("--report", type=pathlib.Path, help="the folder of a report")
    parser.add_argument("tests", nargs="*", help="names of tests; all if none")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        is_sample = options.sample is not None
        folder = pathlib.Path(temporary) if is_sample else options.report.resolve()
        if is_sample:
            subprocess.run([options.sample.resolve(), folder], check=True)
        names = [f"ReportPage.{name}" for name in options.tests]
        with Browser() as browser:
            browser.send("DOM.enable")
            result = unittest.main(argv=[sys.argv[0], *names], exit=False, verbosity=2).result
    sys.exit(0 if result.wasSuccessful() and result.testsRun else 1)


if __name__ == "__main__":
    main()
