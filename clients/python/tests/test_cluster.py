"""The files of examples/cluster run as written: a small stand-in for Slurm and one for Kubernetes start the tasks as the files say, with fewer
samples."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT

SAMPLES = 4000
CLUSTER = ROOT / "examples" / "cluster"
SWEEP = ["--vary", "wh=normal:2u:0.05u", "--samples", str(SAMPLES), "--seed", "7", "--analysis", "modes", "--count", "3", "--threads", "1"]


@pytest.fixture(scope="module")
def folder(program: str) -> Iterator[Path]:
    """A folder that other users may enter, with the command in bin/."""
    made = Path(tempfile.mkdtemp(prefix="bimorph-cluster-"))
    made.chmod(0o755)
    (made / "bin").mkdir()
    shutil.copy(program, made / "bin" / "bimorph")
    yield made
    shutil.rmtree(made, ignore_errors=True)


@pytest.fixture(scope="module")
def whole(folder: Path) -> bytes:
    """The table of one run."""
    subprocess.run([folder / "bin" / "bimorph", "sweep", ROOT / "examples/bank/bank.net", *SWEEP, "--out", folder / "whole.csv"], check=True, capture_output=True)
    return (folder / "whole.csv").read_bytes()


def environment(folder: Path, **more: str) -> dict[str, str]:
    """Of a task: the command on PATH, and what the cluster says."""
    return {"PATH": f"{folder / 'bin'}:/usr/bin:/bin", "HOME": "/nonexistent", **more}


def merged(folder: Path, rows: Path) -> bytes:
    """The table of all shards."""
    parts = sorted(map(str, rows.glob("part*.csv")))
    out = rows / "whole.csv"
    subprocess.run([folder / "bin" / "bimorph", "merge", *parts, "--out", out], check=True, capture_output=True)
    return out.read_bytes()


class Slurm:
    """Starts the tasks of a batch script: a copy of it for each index, in the folder of submission, with the variables of an array."""

    def __init__(self, folder: Path, script: Path, submitted_from: Path) -> None:
        self.folder, self.submitted_from = folder, submitted_from
        self.text = script.read_text()
        found = re.search(r"^#SBATCH --array=(\d+)-(\d+)$", self.text, re.MULTILINE)
        assert found and self.text.startswith("#!/bin/bash")
        self.indexes = list(range(int(found[1]), int(found[2]) + 1))

    def start(self, index: int, among: list[int]) -> subprocess.Popen[bytes]:
        """One task of an array of these indexes."""
        spooled = self.folder / f"slurm_script_{index}"
        spooled.write_text(self.text)
        array = {"ID": index, "COUNT": len(among), "MIN": min(among), "MAX": max(among)}
        variables = {f"SLURM_ARRAY_TASK_{name}": str(value) for name, value in array.items()}
        env = environment(self.folder, SAMPLES=str(SAMPLES), SLURM_SUBMIT_DIR=str(self.submitted_from), **variables)
        return subprocess.Popen(["bash", spooled], cwd=self.submitted_from, env=env, stderr=subprocess.PIPE, start_new_session=True)

    def run(self, among: list[int]) -> None:
        """All of them, a few at a time."""
        for k in range(0, len(among), 4):
            for task in [self.start(index, among) for index in among[k : k + 4]]:
                error = task.communicate()[1]
                assert task.returncode == 0, error.decode()


def submission(folder: Path) -> Path:
    """A checkout to submit from: the examples alone."""
    place = folder / "checkout"
    shutil.copytree(ROOT / "examples", place / "examples", ignore=shutil.ignore_patterns("*.rs"))
    return place


def test_slurm(folder: Path, whole: bytes) -> None:
    """Two tasks are killed and queued again by themselves, when the array has two tasks; the shards together are the bytes of one run."""
    slurm = Slurm(folder, CLUSTER / "sweep.sbatch", submission(folder))
    rows = slurm.submitted_from / "rows"
    killed = [3, 7]
    for index in killed:
        # within its rows, or before the first one, or after the last one: whenever that is, it continues
        task, until = slurm.start(index, slurm.indexes), time.monotonic() + 60.0
        while not list(rows.glob(f"part{index}.csv*")) and time.monotonic() < until:
            time.sleep(0.001)
        os.killpg(task.pid, signal.SIGKILL)
        task.communicate()
    slurm.run([index for index in slurm.indexes if index not in killed])
    slurm.run(killed)
    assert len(list(rows.glob("part*.csv"))) == len(slurm.indexes) == 20
    assert merged(folder, rows) == whole


class Kubernetes:
    """Starts the pods of an indexed job with their volumes, user and environment; paths of volumes lie below a folder."""

    def __init__(self, folder: Path, file: Path) -> None:
        yaml = pytest.importorskip("yaml")
        self.folder, self.root = folder, folder / "node"
        self.maps = self._created(file.read_text())
        documents = list(yaml.safe_load_all(file.read_text()))
        self.claims = {one["metadata"]["name"]: one["spec"] for one in documents if one["kind"] == "PersistentVolumeClaim"}
        (job,) = (one for one in documents if one["kind"] == "Job")
        self.job: dict[str, Any] = job["spec"]
        self.pod: dict[str, Any] = self.job["template"]["spec"]
        (self.container,) = self.pod["containers"]
        self.mounts = {one["mountPath"]: self._volume(one["name"]) for one in self.container["volumeMounts"]}

    def _created(self, text: str) -> dict[str, dict[str, Path]]:
        """The ConfigMaps that the head of the file creates."""
        found: dict[str, dict[str, Path]] = {}
        for line in re.findall(r"^#\s+kubectl create configmap (.*)$", text, re.MULTILINE):
            name, *files = shlex.split(line)
            paths = [ROOT / file.removeprefix("--from-file=") for file in files]
            found[name] = {path.name: path for path in paths}
        return found

    def _volume(self, name: str) -> Path:
        """The contents of a volume of the pod."""
        (volume,) = (one for one in self.pod["volumes"] if one["name"] == name)
        place = self.root / name
        place.mkdir(parents=True)
        if "configMap" in volume:
            for item in volume["configMap"]["items"]:
                target = place / item["path"]
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(self.maps[volume["configMap"]["name"]][item["key"]], target)
            return place
        claim = self.claims[volume["persistentVolumeClaim"]["claimName"]]
        assert "ReadWriteMany" in claim["accessModes"] or self.job["parallelism"] == 1
        # as the kubelet does it for a group of the file system
        place.chmod(0o2775)
        if os.getuid() == 0:
            os.chown(place, 0, self.pod["securityContext"]["fsGroup"])
        return place

    def _here(self, text: str) -> str:
        for path, place in self.mounts.items():
            text = re.sub(rf"(?<![\w.]){re.escape(path)}(?=/|\s|$)", str(place), text)
        return text

    def start(self, index: int) -> subprocess.Popen[bytes]:
        """The pod of one index."""
        env = {one["name"]: one["value"] for one in self.container["env"]}
        assert env["SAMPLES"] == "10000"
        env |= {"SAMPLES": str(SAMPLES), "JOB_COMPLETION_INDEX": str(index)}
        user: dict[str, Any] = {}
        security = self.pod["securityContext"]
        assert security["runAsNonRoot"] and security["runAsUser"] != 0
        if os.getuid() == 0:
            user = {"user": security["runAsUser"], "group": security["runAsGroup"], "extra_groups": [security["fsGroup"]]}
        words = [self._here(word) for word in (*self.container["command"], *self.container["args"])]
        cwd = self._here(self.container["workingDir"])
        return subprocess.Popen(words, cwd=cwd, env=environment(self.folder, **env), stderr=subprocess.PIPE, **user)


def test_kubernetes(folder: Path, whole: bytes) -> None:
    """Each index of the job is a shard, the includes of the netlist are there, the user writes to the volume, and the shards together are the bytes
    of one run."""
    cluster = Kubernetes(folder, CLUSTER / "sweep.yaml")
    count = cluster.job["completions"]
    assert cluster.job["completionMode"] == "Indexed" and cluster.pod["restartPolicy"] == "Never"
    for k in range(0, count, 4):
        for pod in [cluster.start(index) for index in range(k, min(k + 4, count))]:
            error = pod.communicate()[1]
            assert pod.returncode == 0, error.decode()
    rows = cluster.mounts["/work"] / "rows"
    assert len(list(rows.glob("part*.csv"))) == count
    assert merged(folder, rows) == whole
