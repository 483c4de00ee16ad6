"""Client of the Bimorph device-model server.

``Client`` talks to a server, ``Model`` is a compiled netlist on it, ``Session`` one device with states that a circuit
or a test bench steps. ``serve()`` starts a server for the time of a ``with`` block, ``local()`` has models in this process. All quantities are SI: m, rad, s,
V, A, C, K, Hz.
"""

import importlib.metadata

from . import aio
from .aloud import AccuracyWarning, NetlistWarning
from .batch import Batch, BatchRun, Failure
from .client import Client, local
from .conversion import Conversion, LayoutWarning, Piece
from .errors import (
    BimorphError,
    Diagnostic,
    InvalidRequest,
    InvalidType,
    LimitExceeded,
    NetlistError,
    NoResult,
    NotFound,
    Refused,
    StepFailed,
    Unavailable,
    UnexpectedReply,
    Violation,
)
from .executors import sweep_on
from .exports import ExportResult
from .model import Model
from .netlist import Netlist
from .options import Options
from .paths import CriticalPoint, PathResult
from .results import (
    AnchorForce,
    Crossing,
    FrequencyResponse,
    ModeLoss,
    ModesResult,
    NodeMotion,
    PullInResult,
    Root,
    StabilityLoss,
    StaticResult,
    Statistics,
    TransientResult,
)
from .runs import Run, RunFailed
from .server import Server, serve
from .session import Session
from .sweep import LogNormal, Modes, Normal, PullIn, Samples, Static, Transient, Uniform
from .sweep_handle import Sweep, SweepStatus
from .sweep_statistics import ColumnStatistics, Fraction, Histogram, Limit, SweepStatistics
from .table import Row, Table
from .ticket import Snapshot, Ticket
from .trial_reply import TrialReply

__all__ = [
    "AccuracyWarning",
    "AnchorForce",
    "Batch",
    "BatchRun",
    "BimorphError",
    "Client",
    "ColumnStatistics",
    "Conversion",
    "CriticalPoint",
    "Crossing",
    "Diagnostic",
    "ExportResult",
    "Failure",
    "Fraction",
    "FrequencyResponse",
    "Histogram",
    "InvalidRequest",
    "InvalidType",
    "LayoutWarning",
    "Limit",
    "LimitExceeded",
    "LogNormal",
    "Model",
    "Modes",
    "ModeLoss",
    "ModesResult",
    "Netlist",
    "NetlistError",
    "NetlistWarning",
    "NoResult",
    "NodeMotion",
    "Normal",
    "NotFound",
    "Options",
    "PathResult",
    "Piece",
    "PullIn",
    "PullInResult",
    "Refused",
    "Root",
    "Row",
    "Run",
    "RunFailed",
    "Samples",
    "Server",
    "Session",
    "Snapshot",
    "StabilityLoss",
    "Static",
    "StaticResult",
    "Statistics",
    "StepFailed",
    "Sweep",
    "SweepStatistics",
    "SweepStatus",
    "Table",
    "Ticket",
    "Transient",
    "TransientResult",
    "TrialReply",
    "Unavailable",
    "UnexpectedReply",
    "Uniform",
    "Violation",
    "aio",
    "local",
    "serve",
    "sweep_on",
]

__version__ = importlib.metadata.version("bimorph-mems")
"""Of this package; :meth:`Client.version` is that of a server."""
