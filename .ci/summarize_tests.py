#!/usr/bin/env python3
"""One line a test suite from the XML files that GoogleTest wrote, and one line for all.

Usage: summarize_tests.py RESULTS_FOLDER

Fails (exit 1) if a test failed, if a suite crashed before it wrote its file, or if a test was skipped for any reason other
than the missing shared data.
"""

import pathlib
import sys
import xml.etree.ElementTree as ElementTree

ACCEPTED_SKIP = "needs FIELDLIGHT_SHARED"


def main(folder):
    totals = {"passed": 0, "failed": 0, "skipped": 0, "shared_ran": 0, "shared_skipped": 0}
    problems = []
    for exit_code_file in sorted(folder.glob("*.exit")):
        name = exit_code_file.stem
        exit_code = int(exit_code_file.read_text())
        results = folder / (name + ".xml")
        passed = failed = skipped = 0
        seconds = 0.0
        if not results.exists():
            problems.append(f"{name}: ended with {exit_code} and wrote no results")
            print(f"{name:<28} CRASHED (exit {exit_code})")
            totals["failed"] += 1
            continue
        root = ElementTree.parse(results).getroot()
        seconds = float(root.get("time", "0"))
        for case in root.iter("testcase"):
            title = f"{name}: {case.get('classname')}.{case.get('name')}"
            skip = case.find("skipped")
            if case.find("failure") is not None:
                failed += 1
                problems.append(f"{title} failed: {case.find('failure').get('message', '').splitlines()[:3]}")
            elif skip is not None:
                skipped += 1
                if ACCEPTED_SKIP in (skip.get("message") or "") + (skip.text or ""):
                    totals["shared_skipped"] += 1
                else:
                    failed += 1
                    problems.append(f"{title} was skipped: {skip.get('message')}")
            else:
                passed += 1
                if any(p.get("name") == "uses_shared" for p in case.iter("property")):
                    totals["shared_ran"] += 1
        if exit_code != 0 and failed == 0:
            failed += 1
            problems.append(f"{name}: all tests passed but it ended with {exit_code}")
        print(f"{name:<28} {passed:5} passed {failed:4} failed {skipped:4} skipped {seconds:8.1f} s")
        totals["passed"] += passed
        totals["failed"] += failed
        totals["skipped"] += skipped
    for problem in problems:
        print("  ", problem)
    print(f"tests that use the shared scenes: {totals['shared_ran']} ran, {totals['shared_skipped']} skipped")
    if totals["passed"] == 0:
        print("no test ran")
    print(f"{totals['passed']} passed, {totals['failed']} failed, {totals['skipped']} skipped")
    return 1 if totals["failed"] or totals["passed"] == 0 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
