"""Conversion of sweeps to messages."""

from __future__ import annotations

from typing import Any

from .arguments import instance
from .sweep import Analysis, Axes, LogNormal, Modes, Normal, PullIn, Samples, Static, Transient, points, shard_of
from .v1 import analysis_pb2, model_pb2, sweep_pb2


def setting(name: str, value: float | str) -> Any:
    """Message of a named value."""
    if isinstance(value, str):
        return model_pb2.Setting(name=name, text=value)
    return model_pb2.Setting(name=name, number=value)


def to_wire(
    parameters: Axes,
    analysis: Analysis,
    shard: tuple[int, int],
    samples: Samples | None = None,
) -> Any:
    """Message of a specification.

    Raises :class:`InvalidRequest` for an invalid one.
    """
    expected = "an analysis: Static, Modes, PullIn or Transient"
    analysis = instance("analysis", analysis, (Static, Modes, PullIn, Transient), expected)
    part = shard_of(shard)
    spec = sweep_pb2.SweepSpec(parameters=_axes(parameters), shard=part[0], shards=part[1])
    if samples is not None:
        spec.samples.CopyFrom(_samples(instance("samples", samples, Samples, "Samples or None")))
    if isinstance(analysis, PullIn):
        spec.pull_in.CopyFrom(sweep_pb2.SweepPullIn(port=analysis.port, max_v=analysis.max_v))
        return spec
    voltages = [analysis_pb2.Named(name=name, value=value) for name, value in analysis.voltages.items()]
    if isinstance(analysis, Static):
        spec.static.CopyFrom(sweep_pb2.SweepStatic(outputs=analysis.outputs, voltages=voltages))
    elif isinstance(analysis, Transient):
        wire = sweep_pb2.SweepTransient(stop_s=analysis.stop, outputs=analysis.signals, voltages=voltages)
        spec.transient.CopyFrom(wire)
    else:
        spec.modes.CopyFrom(sweep_pb2.SweepModes(count=analysis.count, voltages=voltages))
    return spec


def _axes(parameters: Axes) -> list[Any]:
    axes = []
    for names, rows in points(parameters):
        for k, name in enumerate(names):
            listed = sweep_pb2.SettingList(values=[setting("", row[k]) for row in rows])
            axes.append(sweep_pb2.SweepParameter(name=name, **{"in_step" if k else "list": listed}))
    return axes


def _samples(samples: Samples) -> Any:
    vary = []
    for name, given in samples.vary.items():
        if isinstance(given, Normal):
            one = sweep_pb2.SweepVary(name=name, normal=sweep_pb2.SweepNormal(mean=given.mean, deviation=given.deviation))
        elif isinstance(given, LogNormal):
            wire = sweep_pb2.SweepLogNormal(median=given.median, deviation=given.deviation)
            one = sweep_pb2.SweepVary(name=name, log_normal=wire)
        else:
            one = sweep_pb2.SweepVary(name=name, uniform=sweep_pb2.SweepUniform(low=given.low, high=given.high))
        vary.append(one)
    designs = {
        "random": sweep_pb2.SweepSamples.DESIGN_RANDOM,
        "lhs": sweep_pb2.SweepSamples.DESIGN_LATIN_HYPERCUBE,
        "sobol": sweep_pb2.SweepSamples.DESIGN_SOBOL,
    }
    correlations = [sweep_pb2.SweepCorrelation(a=a, b=b, value=value) for (a, b), value in samples.correlations.items()]
    return sweep_pb2.SweepSamples(
        vary=vary,
        count=samples.count,
        seed=samples.seed,
        design=designs[samples.design],
        correlations=correlations,
    )
