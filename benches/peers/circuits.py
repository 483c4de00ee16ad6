"""Error against processor time of ngspice for the comb resonator of tests/decks, behind the plug-in and in B-sources; see `benches/peers/transients`.

    circuits.py PLUGIN ROWS

Appends rows to those of transients.py. Both decks run with the same longest steps and relative tolerances, the plug-in with the same `tol` too. The error is
that of the displacement, root mean square of half of its range, from B-sources in steps of 1 ns. The second reference has steps of 2 ns. Times are user and
system time of ngspice, less that of a run of one step.
"""

import csv
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from transients import COLUMNS, FLOOR, off, resampled

DECKS = Path(__file__).resolve().parent.parent.parent / "tests" / "decks"
STOP = 90e-6
STEPS = [2e-6, 1e-6, 5e-7, 2e-7, 1e-7, 5e-8, 2e-8, 1e-8, 5e-9]
RELATIVE = [1e-3, 1e-4, 1e-5, 1e-6]
# A step that a reference is made with.
FINE = 1e-9
REPEATS = 3


class Bench:
    def __init__(self, plugin, folder):
        self.folder = Path(folder)
        (self.folder / "comb.net").write_text((DECKS / "comb.net").read_text())
        # ngspice writes the paths of a deck in small letters
        (self.folder / "bimorph.cm").symlink_to(Path(plugin).resolve())

    def deck(self, name, step, relative, stop):
        drive = re.sub(r"reltol=\S+", f"reltol={relative:g}", (DECKS / "comb_drive.inc").read_text())
        text = (DECKS / name).read_text().replace(".include comb_drive.inc\n", drive + "\n")
        text = re.sub(r"tol=1e-5\)", f"tol={max(relative, 1e-5):g})", text)
        lines = [line for line in text.splitlines() if not re.match(r"\.(op|ac|tran|end)\b", line)]
        lines += [".control", "pre_codemodel ./bimorph.cm", f"tran {step:g} {stop:g} 0 {step:g}", "wrdata out v(x)", "quit", ".endc", ".end"]
        (self.folder / "run.cir").write_text("\n".join(lines) + "\n")

    def seconds(self, name, step, relative, stop):
        self.deck(name, step, relative, stop)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([os.environ.get("NGSPICE", "ngspice"), "-b", "run.cir"], cwd=self.folder, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime

    def run(self, name, step, relative):
        """Displacement [µm] at equal times, accepted points, and processor time [s]."""
        spent = min(self.seconds(name, step, relative, STOP) for _ in range(REPEATS))
        table = np.loadtxt(self.folder / "out")
        _, first = np.unique(table[:, 0], return_index=True)
        table = table[first]
        base = min(self.seconds(name, step, relative, step) for _ in range(REPEATS))
        return resampled(table[:, 0], [table[:, 1]], STOP), len(table), max(spent - base, 1e-4)


def main(plugin, rows):
    with tempfile.TemporaryDirectory() as folder, open(rows, "a", newline="") as file:
        out = csv.DictWriter(file, COLUMNS, restval="")
        bench = Bench(os.path.abspath(plugin), folder)
        wanted, *_ = bench.run("comb_b_sources.cir", FINE, 1e-8)
        second, *_ = bench.run("comb_b_sources.cir", 2 * FINE, 1e-8)
        out.writerow({"problem": "comb_in_ngspice", "program": FLOOR, "error": f"{off(second, wanted):.4g}"})
        for name, program, variant in (("comb_b_sources.cir", "B-sources", ""), ("comb.cir", "bimorph", "plug-in")):
            for relative in RELATIVE:
                for step in STEPS:
                    found, points, spent = bench.run(name, step, relative)
                    out.writerow(
                        {
                            "problem": "comb_in_ngspice",
                            "program": program,
                            "variant": variant,
                            "mesh": f"{step:g}",
                            "steps": points,
                            "tol": relative,
                            "run_s": f"{spent:.5g}",
                            "error": f"{off(found, wanted):.4g}",
                        }
                    )


if __name__ == "__main__":
    main(*sys.argv[1:])
