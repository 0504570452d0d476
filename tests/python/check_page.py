"""Opens a page in headless Chromium, at the widths of a telephone, a tablet and a screen, and says what is wrong with it:
messages on its console, elements that are wider than the window, requests for anything outside the page.

    python3 tests/python/check_page.py paper.html [--screenshots DIR] [--top FILE]

`--screenshots` leaves pictures of the whole page and what it prints as; `--top` one of its top, as the README shows it. Needs a Chromium (Debian's `chromium`) and Python's standard library. Exit code 0: nothing; 1: something; 3: no Chromium.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

WIDTHS = [360, 768, 1280]
TOP = (1100, 860)
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--enable-logging=stderr", "--v=0",
    "--force-device-scale-factor=1",
]

# Runs inside a copy of the page, which is shown in a frame of the width: a window may not be as narrow as a telephone.
MEASURE = """<script>
addEventListener("load", () => {
  const width = document.documentElement.clientWidth;
  const wide = [...document.body.querySelectorAll("*")]
    .filter((e) => !e.closest("svg") && e.getBoundingClientRect().right > width + 0.5)
    .map((e) => e.tagName + "." + e.className + " to " + Math.round(e.getBoundingClientRect().right));
  parent.postMessage({
    width, scroll: document.documentElement.scrollWidth, wide: wide.slice(0, 5),
    fetched: performance.getEntriesByType("resource").map((e) => e.name).filter((n) => !n.startsWith("data:")),
    unnamed: [...document.querySelectorAll("img:not([alt]), svg:not([role]):not([aria-hidden])")].length,
    headless_tables: [...document.querySelectorAll("table")].filter((t) => !t.querySelector("th[scope]")).length,
  }, "*");
});
</script>"""

FRAME = """<!DOCTYPE html><meta charset="utf-8"><title>frame</title><style>body{margin:0}iframe{border:0}</style>
<iframe src="copy.html" width="%d" height="2000"></iframe><pre id="measured"></pre>
<script>addEventListener("message", (e) => { document.getElementById("measured").textContent = JSON.stringify(e.data); });</script>"""


def chromium(browser, *arguments):
    with tempfile.TemporaryDirectory() as profile:
        command = [browser, *FLAGS, f"--user-data-dir={profile}", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def problems_at(browser, page, width):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        text = page.read_text(encoding="utf-8")
        (folder / "copy.html").write_text(text.replace("</body>", MEASURE + "</body>"), encoding="utf-8")
        (folder / "frame.html").write_text(FRAME % width, encoding="utf-8")
        run = chromium(browser, "--virtual-time-budget=10000", f"--window-size={max(width, 800)},2000",
                       "--dump-dom", (folder / "frame.html").as_uri())
    found = re.search(r'<pre id="measured">(\{.*?\})</pre>', run.stdout, re.DOTALL)
    if not found:
        return [f"{width} px: the page did not load: {run.stderr[-500:]}"]
    measured = json.loads(found.group(1).replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&"))
    problems = []
    if measured["width"] != width:
        problems.append(f"{width} px: shown {measured['width']} px wide")
    if measured["scroll"] > width:
        problems.append(f"{width} px: scrolls sideways to {measured['scroll']} px")
    problems += [f"{width} px: too wide: {element}" for element in measured["wide"]]
    problems += [f"{width} px: fetches {name}" for name in measured["fetched"]]
    if measured["unnamed"]:
        problems.append(f"{width} px: {measured['unnamed']} pictures have no words")
    if measured["headless_tables"]:
        problems.append(f"{width} px: {measured['headless_tables']} tables have no headers")
    problems += [f"{width} px: console: {line}" for line in run.stderr.splitlines() if ":CONSOLE" in line]
    return problems


def main():
    page = pathlib.Path(sys.argv[1]).resolve()
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not browser:
        print("no Chromium: install Debian's package chromium", file=sys.stderr)
        return 3
    problems = [problem for width in WIDTHS for problem in problems_at(browser, page, width)]
    if "--screenshots" in sys.argv:
        folder = pathlib.Path(sys.argv[sys.argv.index("--screenshots") + 1])
        folder.mkdir(parents=True, exist_ok=True)
        for width in WIDTHS:
            framed = folder / "frame.html"
            framed.write_text(FRAME.replace('2000"', '12000"').replace("copy.html", page.as_uri()) % width, encoding="utf-8")
            chromium(browser, f"--window-size={max(width, 800)},12000", f"--screenshot={folder / f'{width}.png'}",
                     framed.as_uri())
            framed.unlink()
        chromium(browser, "--no-pdf-header-footer", f"--print-to-pdf={folder / 'print.pdf'}", page.as_uri())
    if "--top" in sys.argv:
        picture = pathlib.Path(sys.argv[sys.argv.index("--top") + 1]).resolve()
        chromium(browser, f"--window-size={TOP[0]},{TOP[1]}", f"--screenshot={picture}", page.as_uri())
    for problem in problems:
        print(problem)
    print(f"{page.name}: {len(problems)} problems at {', '.join(map(str, WIDTHS))} px")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
