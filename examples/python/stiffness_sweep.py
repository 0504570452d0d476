#!/usr/bin/env python3
"""Sweep the two gains of the grasp law over a scene: where does the grasp hold, and when does it come to rest?

    python3 stiffness_sweep.py cube-ideal --stiffness 0 2e-3 5e-3 --force 2.5 5 --duration 5
    python3 stiffness_sweep.py ../../models/scenes/cube.toml --set friction.scale=0.5 --csv sweep.csv

Every combination is a run of `blindgrasp sim SCENE --json`, several at a time. The table goes to the standard output, progress
to the standard error. Nothing is needed but Python's standard library and the command, which `cargo build --release` builds.

Exit code 0: every run was done, whatever came of it; 2: bad input, or there is no command. Python 3.9 or later.
"""

import argparse
import concurrent.futures
import contextlib
import csv
import itertools
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]

# Column, the words above it in the table, and how a value is shown there.
COLUMNS = [
    ("attitude_stiffness_nm", "K_st, N m", "{:g}"),
    ("force_n", "f_d, N", "{:g}"),
    ("held", "held", "{}"),
    ("lost_at_s", "lost at, s", "{:.2f}"),
    ("at_rest_from_s", "at rest from, s", "{:.2f}"),
    ("friction_needed", "friction needed", "{:.2f}"),
    ("normal_force_error", "off Eq. 57, %", "{:.1%}"),
    ("why_lost", "why lost", "{}"),
]


class Failure(Exception):
    """What is wrong, in one line."""


def find_command(given):
    """The path of the command: the one that was named, else that of the environment, the repository, or the PATH."""
    named = given or os.environ.get("BLINDGRASP")
    if named:
        found = shutil.which(named)
        if not found:
            raise Failure(f"{named} is no program that can be run: check --blindgrasp, or the variable BLINDGRASP")
        return found
    built = REPOSITORY / "target" / "release" / "blindgrasp"
    found = shutil.which(built) or shutil.which("blindgrasp")
    if not found:
        raise Failure(
            "the command blindgrasp is not there: build it with `cargo build --release` in the repository, "
            "or name it with --blindgrasp"
        )
    return found


def simulate(command, scene, settings, duration_s):
    """The summary of one run, as `blindgrasp sim --json` gives it."""
    arguments = [command, "sim", scene, "--json"]
    for setting in settings:
        arguments += ["--set", setting]
    if duration_s is not None:
        arguments += ["--duration", repr(duration_s)]
    run = subprocess.run(arguments, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    # 0: held; 1: lost. Both are results.
    if run.returncode not in (0, 1):
        said = run.stderr.strip().splitlines() or [f"ended with exit code {run.returncode}"]
        raise Failure(said[-1])
    try:
        return json.loads(run.stdout)
    except ValueError as error:
        raise Failure(f"{command} printed no JSON: {error}") from error


def row(stiffness_nm, force_n, summary):
    """What is of interest of a summary."""
    final = summary["final"]
    pairs = zip(final["normal_force_n"], final["desired_normal_force_n"])
    errors = [abs(force / desired - 1.0) for force, desired in pairs if desired > 0.0]
    held = summary["grasp_held"]
    return {
        "attitude_stiffness_nm": stiffness_nm,
        "force_n": force_n,
        "held": "yes" if held else "LOST",
        "lost_at_s": summary["lost_at_s"],
        "at_rest_from_s": summary["settle_time_s"],
        "friction_needed": summary["friction_demand_max"],
        "normal_force_error": max(errors, default=None) if held else None,
        "why_lost": summary["fault"] or summary["lost_reason"],
    }


def progress(words):
    """Shows where it is, in place of what was shown before; only to somebody who watches."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{words}", end="", file=sys.stderr, flush=True)


def sweep(command, arguments):
    """A row for every combination, in the order in which they were asked for."""
    combinations = list(itertools.product(arguments.stiffness, arguments.force))

    def one(combination):
        stiffness_nm, force_n = combination
        gains = [f"control.attitude_stiffness_nm={stiffness_nm!r}", f"control.force_n={force_n!r}"]
        # What the user sets comes first: it may name another hand, which gains stand on.
        return simulate(command, arguments.scene, arguments.settings + gains, arguments.duration)

    rows = {}
    with concurrent.futures.ThreadPoolExecutor(max_workers=arguments.jobs) as pool:
        runs = {pool.submit(one, combination): combination for combination in combinations}
        try:
            for run in concurrent.futures.as_completed(runs):
                combination = runs[run]
                rows[combination] = row(*combination, run.result())
                progress(f"{len(rows)} of {len(combinations)} runs done")
        except BaseException:
            # Runs that have begun end by themselves; the others need not begin.
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            progress("")
    return [rows[combination] for combination in combinations]


def table(rows):
    """Lines of a table with aligned columns; a dash where there is no value."""
    shown = [[words for _, words, _ in COLUMNS]]
    for values in rows:
        cells = ((values[name], form) for name, _, form in COLUMNS)
        shown.append(["-" if value is None else form.format(value).rstrip("%") for value, form in cells])
    widths = [max(map(len, column)) for column in zip(*shown)]
    for cells in shown:
        # The last one is text.
        aligned = [cell.rjust(width) for cell, width in zip(cells[:-1], widths)] + [cells[-1]]
        yield "  ".join(aligned).rstrip()


def write_csv(path, rows):
    """The same as a file; what there is no value for is empty."""
    to_file = path != "-"
    try:
        file = open(path, "w", newline="", encoding="utf-8") if to_file else contextlib.nullcontext(sys.stdout)
        with file as file:
            writer = csv.DictWriter(file, [name for name, _, _ in COLUMNS], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise Failure(f"cannot write {path}: {error.strerror}") from error


def number(least, open_end=False):
    """A parser of finite numbers from `least` on, or above it."""

    def parse(text):
        value = float(text)
        if not (math.isfinite(value) and (value > least if open_end else value >= least)):
            words = "above" if open_end else "at least"
            raise argparse.ArgumentTypeError(f"{text} is not a number that is {words} {least:g}")
        return value

    parse.__name__ = "number"
    return parse


def parser():
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="Exit code 0: every run was done; 2: bad input, or no command."
    )
    parser.add_argument("scene", nargs="?", default="cube-ideal", help="built-in scene, or path of one [default: cube-ideal]")
    parser.add_argument("--stiffness", metavar="NM", type=number(0), nargs="+", default=[0.0, 1e-3, 2e-3, 5e-3, 1e-2],
                        help="values of K_st, N m [default: 0 1e-3 2e-3 5e-3 1e-2]")
    parser.add_argument("--force", metavar="N", type=number(0, open_end=True), nargs="+", default=[2.5, 5.0],
                        help="values of f_d, N [default: 2.5 5]")
    parser.add_argument("--duration", metavar="S", type=number(0, open_end=True), help="simulated time, s [default: the scene's]")
    parser.add_argument("--set", dest="settings", metavar="KEY=VALUE", action="append", default=[],
                        help="change another value of the scene (may be repeated)")
    parser.add_argument("--csv", metavar="FILE",
                        help="write the rows to a file as well; - for the standard output, without the table")
    parser.add_argument("--jobs", metavar="N", type=int, default=os.cpu_count() or 1, help="runs at a time [default: one a core]")
    parser.add_argument("--blindgrasp", metavar="PATH",
                        help="the command [default: $BLINDGRASP, this repository's, or the PATH's]")
    return parser


def main():
    arguments = parser().parse_args()
    if arguments.jobs < 1:
        parser().error("--jobs has to be at least 1")
    try:
        rows = sweep(find_command(arguments.blindgrasp), arguments)
        if arguments.csv != "-":
            print("\n".join(table(rows)))
        if arguments.csv:
            write_csv(arguments.csv, rows)
        sys.stdout.flush()
    except Failure as failure:
        print(f"stiffness_sweep: {failure}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        # Whoever read it has enough.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
