#!/usr/bin/env python3
"""Makes a picture of a report's page, as for the README.

    tests/page/screenshot.py out/report.html -o report.png [--width 1280] [--height 0] [--dark] [--ratio 2] [--hash 'a=..&mode=..']
                             [--section pictures] [--no-scripts]

A height of 0 is the whole page; --section takes that section alone.
"""

import argparse
import pathlib

from browser import Browser


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=0)
    parser.add_argument("--dark", action="store_true")
    parser.add_argument("--ratio", type=float, default=1.0)
    parser.add_argument("--hash", default="")
    parser.add_argument("--section")
    parser.add_argument("--no-scripts", action="store_true")
    options = parser.parse_args()
    with Browser() as browser:
        browser.set_window(options.width, options.height or 1000, options.dark, options.ratio)
        url = options.report.resolve().as_uri() + ("#" + options.hash if options.hash else "")
        browser.open_page(url, scripts=not options.no_scripts)
        if not options.height:  # The viewer's height follows the window's, so that the window takes the page's.
            browser.set_window(options.width, int(browser.page_height()), options.dark, options.ratio)
        clip = None
        if options.section:
            clip = browser.evaluate(
                f"(() => {{ const box = document.getElementById({options.section!r}).getBoundingClientRect();"
                " return [box.x - 24, box.y + scrollY - 24, box.width + 48, box.height + 48]; })()")
        if not options.no_scripts:
            browser.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        options.output.write_bytes(browser.screenshot(clip=clip))


if __name__ == "__main__":
    main()
