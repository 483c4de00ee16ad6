"""Error against processor time of released frames, by this program, OpenSees and Exudyn; see `benches/peers/transients`.

    transients.py measure PROGRAM EXAMPLE ROWS [PROBLEM …]   all runs as CSV; PROGRAM is `bimorph`, EXAMPLE `peer_transients`
    transients.py draw ROWS PICTURE                          the picture, and the table of times on standard output

Every program integrates the same motion: extensible beams without shear and rotary inertia that meet in points, rigid anchors, rigid plates, no damping,
large displacements. OpenSees and Exudyn run over a grid of meshes and steps, and the best pairs count: their choice costs no time. The runs of this program
choose mesh and steps by the tolerance. Errors are root mean squares of x or y of one node, of half of its range, from the reference of corotated.py.
Times are processor time of the thread for the steps; `whole` adds the mesh search and the equilibrium.
"""

import csv
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

INTERVALS = 300
MESHES = [1, 2, 4, 6, 8, 12, 16, 24]
STEPS = [75, 150, 300, 600, 1200, 2400, 4800, 9600]
# Longest run of a rival [s], and the shortest that is not repeated.
LONGEST, SHORTEST = 4.0, 0.05
TOLERANCES = [0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001, 3e-5, 1e-5]
# Solver of OpenSees: the fastest one of six, but where it ends in an error of memory.
SYSTEMS = {"large_frame": "BandSPD"}
# From here on there are reduced models.
REDUCED = 5e-3
FORMULATIONS = ["compliant", "rcr", "auto", "reduced"]
# Elements and substeps of the reference: the finer of two each.
REFERENCE = {"quarter_stage": (64, 16), "plate": (64, 32), "stop": (128, 64), "small_frame": (64, 32), "large_frame": (64, 64)}
COLUMNS = ["problem", "program", "variant", "mesh", "steps", "tol", "unknowns", "run_s", "whole_s", "error"]
# Rows of the second reference: its difference from the first in the column of the error.
FLOOR = "second reference"
# Errors whose times the table has.
TARGETS = [1e-2, 1e-3, 1e-4]


def off(found, reference):
    half = 0.5 * (reference.max(axis=1) - reference.min(axis=1))
    rms = np.sqrt(np.mean((found - reference) ** 2, axis=1))
    return float(np.max(rms / np.maximum(half, half.max() / 30)))


def resampled(times, values, stop):
    from scipy.interpolate import CubicSpline

    at = np.linspace(0, stop, INTERVALS + 1)
    return np.array([CubicSpline(times, row)(at) for row in values])


def reference(structure, name):
    """Both halvings extrapolated, of second order each: lumped masses, the midpoint rule."""
    from corotated import Corotated

    mesh, substeps = REFERENCE[name]
    runs = {}
    for m, n in ((mesh, substeps // 2), (mesh // 2, substeps // 2), (mesh // 2, substeps)):
        runs[m, n] = Corotated(structure, m).released(structure.node, structure.stop, INTERVALS, n)
    fine, coarse, sharp = runs.values()
    return fine + (fine - coarse) / 3 + (sharp - coarse) / 3


def second_reference(structure, name):
    """The same by Exudyn, whose elements are of another kind, or by OpenSees where parts touch. Steps are extrapolated."""
    from exudyn_cables import Cables

    mesh, substeps = REFERENCE[name]
    if structure.stops:
        import opensees_frames

        return resampled(*opensees_frames.run(structure, mesh, INTERVALS * substeps, within=1e-7)[:2], structure.stop)
    cables = Cables(structure, mesh // 2)
    coarse, fine = (resampled(*cables.run(INTERVALS * n, within=1e-6)[:2], structure.stop) for n in (substeps // 2, substeps))
    return fine + (fine - coarse) / 3


def grid(measure):
    """The runs (mesh, steps, result) of a rival; `measure(mesh)` gives a function of steps."""
    for mesh in MESHES:
        go, each = measure(mesh), 0.0
        for steps in STEPS:
            if each * steps > LONGEST:
                break
            done = go(steps)
            if done is None:
                continue
            while done[2] < SHORTEST and done[3] > 0:
                again = go(steps)
                done = (*done[:2], min(done[2], again[2]), done[3] - 1)
            each = max(done[2] / steps, 1e-9)
            yield mesh, steps, done


def rivals(structure, problem):
    import exudyn_cables
    import opensees_frames

    def opensees(integrator):
        def of_mesh(mesh):
            def go(steps):
                done = opensees_frames.run(structure, mesh, steps, integrator, system=SYSTEMS.get(problem, "SparseSYM"))
                return done and (*done, 2)

            return go

        return of_mesh

    def exudyn(reduced):
        def of_mesh(mesh):
            try:
                cables = exudyn_cables.Cables(structure, mesh, reduced)
            except exudyn_cables.exu.SolverError:
                return lambda _: None

            def go(steps):
                done = cables.run(steps)
                return done and (*done, 2)

            return go

        return of_mesh

    # errors of HHT and TRBDF2 differ by some percent, and generalized alpha finds no step of these motions
    yield "opensees", "Newmark", opensees("Newmark")
    if structure.stops:
        # a spring of this law is a function in Python there
        return
    yield "exudyn", "full integration", exudyn(False)
    yield "exudyn", "reduced integration", exudyn(True)


def measure(program, example, rows, names):
    from structures import ROOT, Structure, problems

    with open(rows, "w", newline="") as file:
        out = csv.DictWriter(file, COLUMNS, restval="")
        out.writeheader()
        for problem in problems(ROOT / "target" / "peers" / "models"):
            if names and problem.name not in names:
                continue
            structure = Structure(program, problem)
            begun = time.time()
            wanted = reference(structure, problem.name)
            row = lambda **more: out.writerow({"problem": problem.name, **more})
            row(program=FLOOR, error=f"{off(second_reference(structure, problem.name), wanted):.4g}")
            print(f"{problem.name}: references in {time.time() - begun:.0f} s", file=sys.stderr, flush=True)
            for name, variant, of_mesh in rivals(structure, problem.name):
                for mesh, steps, (times, values, spent, _) in grid(of_mesh):
                    found = resampled(times, values, structure.stop)
                    row(program=name, variant=variant, mesh=mesh, steps=steps, run_s=f"{spent:.5g}", error=f"{off(found, wanted):.4g}")
                file.flush()
            for formulation in FORMULATIONS:
                tols = [tol for tol in TOLERANCES if formulation != "reduced" or tol >= REDUCED]
                words = [example, problem.netlist, problem.parameter, problem.value, problem.stop, INTERVALS + 1, problem.node, formulation, *tols]
                done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
                for line in done.stdout.splitlines():
                    run = json.loads(line)
                    if "failed" in run:
                        print(f"{problem.name}, {formulation}, {run['tol']:g}: {run['failed']}", file=sys.stderr)
                        continue
                    if formulation == "reduced" and not run["took"].startswith("reduced"):
                        continue
                    error = off(1e6 * np.array(run["signals"]), wanted)
                    row(
                        program="bimorph",
                        variant=formulation,
                        steps=run["steps"],
                        tol=run["tol"],
                        unknowns=run["unknowns"],
                        run_s=f"{run['run']:.5g}",
                        whole_s=f"{run['whole']:.5g}",
                        error=f"{error:.4g}",
                    )
                file.flush()
            print(f"{problem.name}: all in {time.time() - begun:.0f} s", file=sys.stderr, flush=True)


def front(points):
    """The pairs (time, error) that no faster one is better than."""
    best, kept = np.inf, []
    for spent, error in sorted(points):
        if error < best:
            best = error
            kept.append((spent, error))
    return kept


def read(rows):
    """By problem: the difference of both references, and (time, error) by program and formulation, where those of a whole analysis have " with mesh"."""
    found = {}
    for row in csv.DictReader(open(rows)):
        floor, series = found.setdefault(row["problem"], [0.0, {}])
        if row["program"] == FLOOR:
            found[row["problem"]][0] = float(row["error"])
            continue
        label = NAMES[row["variant"] if row["program"] == "bimorph" else row["program"]]
        for column, more in (("run_s", ""), ("whole_s", " with mesh")):
            if row[column]:
                series.setdefault(label + more, []).append((max(float(row[column]), 1e-4), float(row["error"])))
    return found


def draw(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "peers"
    problems, handles = read(rows), {}
    wide = (len(problems) + 1) // 2
    fig, axes = plt.subplots(2, wide, figsize=(4.6 * wide, 8.5), constrained_layout=True, squeeze=False)
    for spare in axes.ravel()[len(problems) :]:
        spare.set_axis_off()
    for axis, (name, (floor, series)) in zip(axes.ravel(), problems.items()):
        for label, points in series.items():
            if label == "auto":
                continue
            clipped = [(t, max(e, floor)) for t, e in points]
            style = STYLES[label.removesuffix(" with mesh")]
            if label in RIVALS:
                axis.plot(*zip(*clipped), ".", ms=3, alpha=0.25, color=style)
            more = dict(ls="--", lw=1.2) if label.endswith(" with mesh") else dict(marker="o", ms=3.5, lw=1.8)
            (handles[label],) = axis.plot(*zip(*front(clipped)), color=style, label=label, **more)
        axis.axhline(floor, color="black", lw=0.8, ls=":")
        axis.set(xscale="log", yscale="log", title=name.replace("_", " "), xlabel="processor time [s]", ylabel="error")
        axis.set_ylim(0.5 * floor, 1.0)
        axis.grid(alpha=0.3)
    fig.legend(handles.values(), handles.keys(), loc="outside lower center", ncol=5, fontsize=9)
    fig.savefig(path, metadata={"Date": None} if str(path).endswith("svg") else {})
    table(problems)


def table(problems):
    """Milliseconds to reach each error, of this program with the mesh search in brackets, and how far the references differ."""

    def reached(points, target, floor):
        times = [t for t, e in points if e <= target]
        return "–" if not times else f"{1e3 * min(times):.2g}" if 1e3 * min(times) < 10 else f"{1e3 * min(times):.0f}"

    print("| motion | program | " + " | ".join(f"{t:.0e}".replace("e-0", "e-") for t in TARGETS) + " | references |\n|---|---|" + "---|" * (len(TARGETS) + 1))
    for name, (floor, series) in problems.items():
        for k, (label, points) in enumerate((label, p) for label, p in series.items() if not label.endswith(" with mesh")):
            cells = []
            for target in TARGETS:
                # errors below the difference of the references are unknown
                cell = reached(points, target, floor) if target >= floor else "…"
                whole = series.get(label + " with mesh")
                cells.append(f"{cell} ({reached(whole, target, floor)})" if whole and cell not in ("–", "…") else cell)
            print(f"| {name.replace('_', ' ') if k == 0 else ''} | {label} | {' | '.join(cells)} | {f'{floor:.1e}'.replace('e-0', 'e-') if k == 0 else ''} |")


NAMES = {
    "opensees": "OpenSees",
    "exudyn": "Exudyn",
    "B-sources": "B-sources",
    "plug-in": "plug-in",
    "compliant": "bodies",
    "rcr": "joints",
    "reduced": "reduced",
    "auto": "auto",
}
RIVALS = {"OpenSees", "Exudyn", "B-sources"}
STYLES = {
    "OpenSees": "#b5482a",
    "Exudyn": "#2a6fb5",
    "B-sources": "#b5482a",
    "bodies": "#1d7a3c",
    "joints": "#8a5fb0",
    "reduced": "#c79a1b",
    "auto": "black",
    "plug-in": "#1d7a3c",
}


if __name__ == "__main__":
    if sys.argv[1] == "measure":
        measure(sys.argv[2], sys.argv[3], sys.argv[4], sys.argv[5:])
    else:
        draw(sys.argv[2], sys.argv[3])
